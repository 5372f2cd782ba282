"""Compilation of the kernel: records, compiler, cache, fingerprints."""
