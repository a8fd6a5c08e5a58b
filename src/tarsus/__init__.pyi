# What `tarsus` offers, each name once: `__init__.py` reads it, and so do type checkers and editors. One line a module.

# Verbs: what the command line does, with the same words.
from tarsus.atlas.verb import atlas as atlas
from tarsus.calibrate.calibrating import calibrate as calibrate
from tarsus.cluster.verb import sweep as sweep
from tarsus.export.verb import export as export
from tarsus.identify.verb import identify as identify
from tarsus.synthesis.recommend import recommend as recommend
from tarsus.inspection.begin import new as new
from tarsus.inspection.installation import devices as devices, doctor as doctor
from tarsus.inspection.show import check as check, show as show
from tarsus.modes.verb import modes as modes
from tarsus.orbits import attractors as attractors, branch as branch
from tarsus.report.explorer import explore as explore
from tarsus.report.movie import movie as movie
from tarsus.report.verb import report as report
from tarsus.solve import simulate as simulate
from tarsus.study.bench import bench as bench
from tarsus.study.yields import yield_ as yield_
from tarsus.synthesis.verb import synthesize as synthesize
from tarsus.validation.verb import validate as validate
from tarsus_reproduce.verb import reproduce as reproduce  # for type checkers: found by its entry point

# Verbs of Python alone.
from tarsus.base.spec import get_value as get_value, quantity as quantity, with_values as with_values
from tarsus.calibrate.weighted_ensemble import load_ensemble as load_ensemble
from tarsus.files.library import load_scene as load_scene
from tarsus.files.toml import read_scene as read_scene, write_scene as write_scene
from tarsus.fit.fitting import fit as fit
from tarsus.model.laws import load_laws as load_laws
from tarsus.orbits import periodic as periodic
from tarsus.records.readers import read_measurement as read_measurement
from tarsus.solve import gradient as gradient, load_run as load_run, simulate_batch as simulate_batch

# Nouns.
from tarsus.base.errors import InputError as InputError
from tarsus.fit import Unknown as Unknown, Unknowns as Unknowns
from tarsus.model.drive.amplifier import Amplifier as Amplifier
from tarsus.model.drive.laws import LinearForce as LinearForce
from tarsus.model.drive.waveforms import Constant as Constant, OnOff as OnOff, Sampled as Sampled, Sine as Sine, Square as Square
from tarsus.model.laws import Adhesion as Adhesion, Electrostatic as Electrostatic, Film as Film, Friction as Friction
from tarsus.model.laws import AdhesionLaw as AdhesionLaw, DampingLaw as DampingLaw, FrictionLaw as FrictionLaw, Gravity as Gravity
from tarsus.model.laws import ImpactLaw as ImpactLaw, Restitution as Restitution, SmoothLaw as SmoothLaw
from tarsus.model.robot import Drive as Drive, Foot as Foot, InertiaLoad as InertiaLoad, ModalLoad as ModalLoad, PointLoad as PointLoad, Robot as Robot
from tarsus.model.scene import Ground as Ground, Initial as Initial, Scene as Scene
from tarsus.model.structure import Beam as Beam, Lumped as Lumped, Modal as Modal, Walker as Walker
from tarsus.solve import Accuracy as Accuracy, Batch as Batch, Run as Run, Session as Session
from tarsus.study.sweep import Sweep as Sweep
from tarsus.tables.table import Table as Table

# Rooms: further laws, waveforms, gaits and so on, by the names that their own pages list.
from tarsus import design as design, impacts as impacts, learn as learn, measure as measure, solve as solve, synthesis as synthesis, validation as validation
from tarsus.model import laws as laws, structure as structures
from tarsus.model.drive import gait as gaits, laws as drives, waveforms as waveforms
from tarsus.report import plot as plot

__version__: str
