"""Which physics the engine computes; part of the key of every stored run."""

PHYSICS_VERSION = "2"
"""Raise this number with every change after which the same model, settings and seed give other observables.

That is: a formula of an effect or a wall, the integration, the order of a sum, the time step chosen by default, how grains
are inserted or settled, how an experiment measures. A default of a setting needs no raise, since the key holds all settings,
and neither does what leaves the results the same to the last bit: speed, pictures, texts. Stored runs of another version
stay in the store and are not used. In doubt raise it: a needless raise costs computing time, a forgotten one gives wrong
answers. An effect or experiment of an outside package states its own version in a class attribute `version`.
"""
