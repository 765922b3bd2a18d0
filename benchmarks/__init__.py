"""How fast the engine is, how it compares with LIGGGHTS on the same machine, and whether its heaps have the right slope."""
