# SPDX-License-Identifier: Apache-2.0
"""A needle in MuJoCo: any model on a slide joint or at the tip of an arm, from Python or as XML for the plugin.

``attach`` and ``step`` need the extra ``mujoco``; ``plugin_xml`` has no requirements.
"""

from .attached import Attached, attach, step
from .bending import AttachedBending, attach_bending
from .elements import plugin_xml

__all__ = ["Attached", "AttachedBending", "attach", "attach_bending", "plugin_xml", "step"]
