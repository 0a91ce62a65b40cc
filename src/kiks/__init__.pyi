"""The public names of KiKS, each of them imported when it is first used."""

from .batch.batch import Batch as Batch
from .batch.loop_timing import Timing as Timing
from .batch.verify import verify as verify
from .client.drive import drive as drive
from .client.epuck import CameraSettings as CameraSettings
from .client.epuck import EPuck as EPuck
from .client.khepera import Khepera as Khepera
from .client.khepera import Status as Status
from .client.matlab_functions import kclose as kclose
from .client.matlab_functions import kopen as kopen
from .client.matlab_functions import ksend as ksend
from .client.matlab_functions import ktime as ktime
from .client.matlab_functions import pause as pause
from .control import controllers as controllers
from .control import measures as measures
from .control.actuators import Actuator as Actuator
from .control.actuators import actuator as actuator
from .control.controller import Controller as Controller
from .control.controller import controller as controller
from .control.measure import Measure as Measure
from .control.measure import measure as measure
from .control.senses import Sense as Sense
from .control.senses import sense as sense
from .errors import (
    ArenaError as ArenaError,
)
from .errors import (
    KiksError as KiksError,
)
from .errors import (
    LinkError as LinkError,
)
from .errors import (
    ParameterError as ParameterError,
)
from .learn import tasks as tasks
from .learn.archive import Archive as Archive
from .learn.champion import Champion as Champion
from .learn.evolution import Evolution as Evolution
from .learn.exam import Exam as Exam
from .learn.policy_export import champion_of_policy as champion_of_policy
from .learn.task import Axis as Axis
from .learn.task import Side as Side
from .learn.task import Task as Task
from .model.arena import Arena as Arena
from .model.robot import RobotSpec as RobotSpec
from .recording.recording import Recording as Recording
from .script.here import here as here
from .sim.simulation import Simulation as Simulation
from .version import __version__ as __version__
