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
from tarsus.solve.codes import EVENT_TYPE as EVENT_TYPE, EventColumns as EventColumns, SENTENCES as SENTENCES, structured_events as structured_events
from tarsus.solve.contacts import CARRIED as CARRIED, Contacts as Contacts, contacts_of as contacts_of, follow_contact as follow_contact
from tarsus.solve.differences import Direction as Direction
from tarsus.solve.engine import BUILT as BUILT, Engine as Engine, SINGLE_RUN as SINGLE_RUN, Shared as Shared
from tarsus.solve.explored import DEFINITIONS as DEFINITIONS, Explored as Explored
from tarsus.solve.flights import Flow as Flow, Launches as Launches, SUBSTEPS as SUBSTEPS, Varied as Varied
from tarsus.solve.outputs import Output as Output, output_rows as output_rows, output_slopes as output_slopes
from tarsus.solve.page_engine import compiled_engine as compiled_engine, engine_bytes as engine_bytes
from tarsus.solve.results import measure_variables as measure_variables, outcome_variable as outcome_variable
from tarsus.solve.run import RUN_FIGURES as RUN_FIGURES, offered as offered
from tarsus.solve.session import Drawn as Drawn
from tarsus.solve.simulation import MOST_STEPS as MOST_STEPS, estimated_steps as estimated_steps, seconds_of as seconds_of
from tarsus.solve.stepping import State as State
from tarsus.solve.trajectories import Trajectories as Trajectories
from tarsus.solve.window import Window as Window, WindowBatch as WindowBatch, WindowStart as WindowStart, simulate_windows as simulate_windows
from tarsus.solve.window_gradients import Entered as Entered, ScenePair as ScenePair, WindowGradients as WindowGradients
