"""The kernel as WebAssembly: building the file, running it, and the file in wheels."""
