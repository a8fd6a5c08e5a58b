"""The core: the native engine and its inputs: nodes, contact modes, blocks, on plain arrays (numpy only)."""

from pathlib import Path

from tarsus.core.processor import engines

__path__ = [*__path__, *engines(Path(__path__[0]))]  # `_native` is found there
