"""From schema version 1 to 2.

Version 2 added topics (the journal, the filters' log) and fields that may be absent: the pad's own view in a detection, the shared
errors of a fix, the drift in an estimate. So nothing that version 1 wrote has to change. What it could not say stays unsaid: a detector of
version 1 names markers only, and which of them is the pad follows from the settings.
"""

from station.migration.step import Step

V1_TO_V2 = Step(from_version=1, changes={})
