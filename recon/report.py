"""What a reconstruction did, in numbers: for people, for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """Figures of one reconstruction, by section.

    Attributes
    ----------
    sections : dict of str to dict of str to value
        "input", "weights", "triangulation", "surface", "mesh", "seconds"; squared lengths say so in their name.
    """

    sections: Mapping[str, Mapping[str, Any]]

    def __getitem__(self, section: str) -> Mapping[str, Any]:
        return self.sections[section]

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Give plain dictionaries."""
        return {name: dict(section) for name, section in self.sections.items()}

    def to_json(self) -> str:
        """Give JSON text, numbers in full."""
        return json.dumps(self.to_dict(), indent=2)

    def __str__(self) -> str:
        width = max(len(key) for section in self.sections.values() for key in section)
        lines = []
        for name, section in self.sections.items():
            lines.append(name)
            lines += [f"  {key.replace('_', ' '):<{width}}  {_shown(value)}" for key, value in section.items()]
        return "\n".join(lines)


def _shown(value: Any) -> str:
    """Short for people: four digits for a float, thousands apart for a count."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return " ".join(_shown(item) for item in value)
    return str(value)
