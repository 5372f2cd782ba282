"""How the kernel becomes machine code: records, compiler, cache, fingerprints, WebAssembly."""
