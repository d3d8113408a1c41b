"""The colours of every picture, on a light and on a dark page."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Palette:
    """One scheme: what is drawn in which colour, as #rrggbb."""

    paper: str
    """Behind everything."""
    card: str
    """Behind a picture."""
    ink: str
    """Text and axes' labels."""
    muted: str
    """Text of less weight."""
    faint: str
    """Grids and borders: nothing depends on seeing them."""
    good: str
    bad: str
    on_verdict: str
    """Text on `good` and on `bad`."""
    bad_text: str
    """Text that says that something is wrong."""
    truth: str
    """What really was."""
    navigated: str
    """What the autopilot believed."""
    setpoint: str
    """What was asked for."""
    raw: str
    """Fixes before the correction."""
    corrected: str
    """Fixes after it."""
    estimate: str
    """What the filter made of them."""
    camera: str
    detector: str
    geolocator: str
    filter: str
    commander: str


LIGHT = Palette(
    paper="#fafaf8", card="#ffffff", ink="#1c2024", muted="#5a636b", faint="#dfe3e6",
    good="#157f3c", bad="#b3261e", on_verdict="#ffffff", bad_text="#b3261e",
    truth="#1c2024", navigated="#7d868e", setpoint="#bf650b", raw="#b84a86", corrected="#12805b", estimate="#2563c9",
    camera="#7a5cc4", detector="#2563c9", geolocator="#12805b", filter="#bf650b", commander="#b84a86",
)  # fmt: skip
DARK = Palette(
    paper="#14171a", card="#1c2024", ink="#e8eaed", muted="#a2abb3", faint="#343a40",
    good="#23803f", bad="#c0453c", on_verdict="#ffffff", bad_text="#ff8a80",
    truth="#f2f4f5", navigated="#8d969e", setpoint="#f0a04b", raw="#e583b5", corrected="#45c99b", estimate="#6aa3ff",
    camera="#a78bfa", detector="#6aa3ff", geolocator="#45c99b", filter="#f0a04b", commander="#e583b5",
)  # fmt: skip


def variable(name: str) -> str:
    """The CSS variable of a colour."""
    return f"--{name.replace('_', '-')}"


def style_rules() -> str:
    """The colours as CSS: light, dark where the reader's system is, and always light on paper."""
    light, dark = _rule(LIGHT), _rule(DARK)
    return (
        f":root {{ color-scheme: light dark; {light} }}\n"
        f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}\n"
    )


def _rule(palette: Palette) -> str:
    return " ".join(f"{variable(field.name)}: {getattr(palette, field.name)};" for field in fields(Palette))
