"""What a study leaves on disk: corrections, tables, figures and a page that shows all of them."""

import base64
import html
from pathlib import Path

from station.biases.artefact import artefact_text, cylindrical_facts, data_digest, extrinsic_facts, write_artefact
from station.biases.quality import Quality, errors_ned_m
from station.biases.study import VARIANTS, Study
from station.biases.tables import study_lines
from station.report.figures.altitude_error import altitude_error
from station.report.figures.cartesian_error import cartesian_error
from station.report.figures.correction_densities import correction_densities
from station.report.figures.cylindrical_error import cylindrical_error
from station.report.figures.error_by_position import error_by_position
from station.report.figures.radial_fit import radial_fit
from station.report.figures.vector_file import VectorFiles

_MODELS = {"mean": "cylindrical, mean", "median": "cylindrical, median", "extrinsic": "extrinsic"}


def correction_path(directory: Path, variant: str) -> Path:
    """Where a variant's correction lies."""
    return directory / f"correction_{variant}.toml"


def write_corrections(study: Study, directory: Path) -> list[Path]:
    """One file a variant."""
    digest, before, written = data_digest(study.hovers), Quality.of(study.records["raw"]), []
    for variant in VARIANTS:
        extrinsic = variant == "extrinsic"
        facts = extrinsic_facts(study.extrinsic) if extrinsic else cylindrical_facts(study.cylindrical)
        quality = {"before": before, "after": Quality.of(study.records[variant])}
        warnings = study.extrinsic.warnings() if extrinsic else []
        text = artefact_text(study.correction(variant), _MODELS[variant], digest, facts, quality, warnings)
        write_artefact(correction_path(directory, variant), text)
        written.append(correction_path(directory, variant))
    return written


def write_figures(study: Study, directory: Path) -> list[VectorFiles]:
    """The paper's Figures 8 to 13.

    Raises:
        ReportError: If they cannot be written.
    """
    raw = study.records["raw"]
    errors = {name: errors_ned_m(records) for name, records in study.records.items()}
    drawn = [
        figure(raw, directory) for figure in (error_by_position, cartesian_error, altitude_error, cylindrical_error)
    ]
    return [*drawn, radial_fit(raw, directory), correction_densities(errors, directory)]


def write_page(study: Study, figures: list[VectorFiles], path: Path) -> None:
    """Tables and figures in one HTML file that opens anywhere."""
    tables = html.escape("\n".join(study_lines(study)))
    pictures = "".join(
        f'<p><img alt="{files.svg.stem}" src="data:image/svg+xml;base64,{base64.b64encode(files.svg.read_bytes()).decode()}"></p>'
        for files in figures
    )
    path.write_text(
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Systematic errors</title>'
        "<style>body{font:15px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
        "pre{overflow-x:auto;font-size:12.5px}img{max-width:100%}</style>"
        f"<h1>Systematic errors of the installation</h1><pre>{tables}</pre>{pictures}</html>\n",
        encoding="utf-8",
    )
