"""From schema version 1 to 2.

Version 2 added the journal, which an old recording simply has not, and the pad's own view in a detection. A detector of version 1
named markers only; which of them is the pad stood in the settings, so its detections say nothing of a pad.
"""

from station.migration.step import Json, Step


def _detection(detection: Json) -> Json:
    return {"pad": None} | detection


V1_TO_V2 = Step(from_version=1, changes={"Detection": _detection})
