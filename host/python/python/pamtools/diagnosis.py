"""The diagnosis as a dict, with the corrected table."""

import json
import os

from . import _native


class Diagnosis(dict):
    """The answer of :func:`diagnose`: the JSON of ``host diagnose`` (schema pam-diagnose/1) as a dict, and what it was made from."""

    def __init__(self, result):
        super().__init__(json.loads(result.json()))
        self._result = result

    def corrected_table(self) -> _native.Table:
        """The table refitted beside the named effects, as ``host diagnose -o`` writes it.

        The effects of the muscle are part of the table; corrections of the bench are stored separately, and
        :meth:`Table.predict` applies both. Effects that do not improve the prediction are left out.
        """
        return self._result.corrected_table()

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the report, one HTML file."""
        self._result.report(os.fspath(path))

    def __reduce__(self):
        # Pickled and copied as what it says.
        return dict, (dict(self),)


def diagnose(campaign: _native.Campaign, muscle: _native.Muscle, report: str | os.PathLike[str] | None = None) -> Diagnosis:
    """Finds the effects that the model lacks, and returns a :class:`Diagnosis`; report names an HTML file to write."""
    found = Diagnosis(_native.diagnose(campaign, muscle))
    if report is not None:
        found.report(report)
    return found
