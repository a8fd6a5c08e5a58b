"""The virtual laboratory: records that an instrument would make of a device, and campaigns of them."""

from tarsus.synthesis.vibrometer import Vibrometer

__all__ = ["Vibrometer"]
