# What simulation offers, each name once: `__init__.py` reads it, and so do type checkers and editors. One line a module.

# Simulation, for users.
from tarsus.files.ledger import Ledger as Ledger
from tarsus.solve.codes import ResultCode as ResultCode
from tarsus.solve.engine import Accuracy as Accuracy
from tarsus.solve.gradients import Gradient as Gradient, GradientBatch as GradientBatch, GradientRun as GradientRun
from tarsus.solve.results import Batch as Batch
from tarsus.solve.run import Run as Run, load_run as load_run
from tarsus.solve.session import Session as Session
from tarsus.solve.simulation import gradient as gradient, simulate as simulate, simulate_batch as simulate_batch

# What the rooms above are made of; they take nothing else from here.
from tarsus.solve.contacts import Contacts as Contacts
from tarsus.solve.engine import Engine as Engine, SINGLE_RUN as SINGLE_RUN
from tarsus.solve.explored import Explored as Explored
from tarsus.solve.flights import Flow as Flow, Launches as Launches, SUBSTEPS as SUBSTEPS, Varied as Varied
from tarsus.solve.outputs import Output as Output, output_rows as output_rows, output_slopes as output_slopes
from tarsus.solve.page_engine import compiled_engine as compiled_engine, engine_bytes as engine_bytes
from tarsus.solve.run import sampled_run as sampled_run
from tarsus.solve.shared import Shared as Shared
from tarsus.solve.simulation import too_long as too_long
from tarsus.solve.stepping import State as State
from tarsus.solve.trajectories import Trajectories as Trajectories
from tarsus.solve.window import Window as Window, WindowBatch as WindowBatch, WindowStart as WindowStart, simulate_windows as simulate_windows
from tarsus.solve.window_gradients import Entered as Entered, ScenePair as ScenePair, WindowGradients as WindowGradients
