"""The commands of the program, one module each; `technic.cli` registers them."""
