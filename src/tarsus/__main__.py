"""`python -m tarsus` is `tarsus`."""

import sys

from tarsus.cli import main

sys.exit(main())
