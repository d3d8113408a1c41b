"""From schema version 2 to 3.

Version 3 lets a marker leave its poses out where those of the pad are the same. Version 2 said them twice, which can still be read.
"""

from station.migration.step import Step

V2_TO_V3 = Step(from_version=2, changes={})
