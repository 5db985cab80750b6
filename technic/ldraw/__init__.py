"""LDraw text to assembly and back: syntax, documents, library, ports, connections."""
