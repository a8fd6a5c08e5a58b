"""The engine for pages: `core/native` as WebAssembly, which runs packets (`tarsus.solve.packet`) in a browser."""
