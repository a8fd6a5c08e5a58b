"""The explorer in a notebook: a widget whose sliders are read and set from Python (extra `notebook`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import anywidget
import traitlets

from tarsus.base.errors import InputError
from tarsus.report.pages import asset
from tarsus.solve import Run

if TYPE_CHECKING:
    from tarsus.report.explorer import Explorer


class ExplorerWidget(anywidget.AnyWidget):
    """An explorer's page. values [SI]: of the sliders that are turned, by the first path of each, read and
    set from here; measures [SI]: of the run that is shown, by name, None where there is none, once the page shows one.

    Raises TraitError for values of what is no slider, and beyond a slider's ends.
    """

    _esm = asset("widget.js")
    page = traitlets.Unicode().tag(sync=True)
    values = traitlets.Dict().tag(sync=True)
    measures = traitlets.Dict().tag(sync=True)

    def __init__(self, explorer: Explorer) -> None:
        self.explorer = explorer
        super().__init__(page=explorer.html())

    @traitlets.validate("values")
    def _checked(self, proposal: Any) -> dict[str, float]:
        sliders = self.explorer.sliders
        values = {path: float(value) for path, value in proposal["value"].items()}
        for path, value in values.items():
            if path not in sliders:
                raise traitlets.TraitError(f"{path}: there is no such slider")
            _, low, high = sliders[path]
            if not low <= value <= high:
                raise traitlets.TraitError(f"{path}: expected a value from {low:g} to {high:g}, got {value:g}")
        try:
            self.explorer.explored.place(values)
        except InputError as error:
            raise traitlets.TraitError(str(error)) from None
        return values

    def run(self) -> Run:
        """The run that is shown, made here. Raises InputError as `tarsus.simulate`."""
        return self.explorer.run(self.values)
