"""A foreign laboratory: a cantilever with one foot, simulated and recorded by code that imports nothing of the library.

What it knows of the library is the format of a campaign's files. Its world may differ from the library's model in one
place at a time (`foreign.world.World`), so that an identification can be asked whether it notices.
"""
