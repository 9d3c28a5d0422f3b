"""What a study and a figure of the paper are: modules with these names, checked by their types."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure as Drawing

    from stiction.papers.albertini2020.data import Data
    from stiction.papers.albertini2020.studies.context import Context
    from stiction.report.tables import Table


class Study(Protocol):
    """What is computed before anything is drawn or judged.

    A module may also have `needs`, the names of studies whose results it uses, and `depends`, the
    attributes of the context besides the setting that its result depends on (samples and seed if
    it has none).
    """

    name: str
    title: str

    def cost(self, context: Context) -> int:
        """Work it will do, for progress."""

    def compute(self, context: Context) -> xr.Dataset:
        """Its result, labelled."""


class Figure(Protocol):
    """A figure, with the numbers behind it.

    A module may also have `may_show`, the names of studies that it shows if they are computed.
    """

    name: str
    number: str
    title: str
    needs: tuple[str, ...]

    def caption(self, data: Data) -> str:
        """What it shows, in a sentence or two."""

    def draw(self, data: Data) -> Drawing:
        """The drawing."""

    def tables(self, data: Data) -> list[Table]:
        """The numbers behind it."""


Named = TypeVar("Named", Study, Figure)


def by_name(*modules: Named) -> dict[str, Named]:
    """Modules by their own name, in the order given."""
    return {module.name: module for module in modules}
