// Numbers that are handed to Python: kinds of events, result codes, states of a foot. A test compares them with
// tarsus/base/events.py and tarsus/core/arrays.py.
#pragma once

namespace tarsus {

enum EventKind {
  BOUNCE = 1,            // reaches the ground and leaves it again
  CAPTURE = 2,           // reaches the ground and is held
  RELEASE = 3,           // its pull exceeds the strength of its contact
  REST = 4,              // its remaining flights are lower than any that matters, and accumulate
  CONTACT_AT_START = 5,  // lies on the ground without an impact
  PERIOD_MARK = 6,       // end of a drive period, in the air
  SLIP_BEGINS = 7,
  STICK_BEGINS = 8,
  AVERAGED_CONTACT = 9   // its flights are lower than any that matters, and hardly shrink: pressed down on average
};

enum Code { DONE, STALL, STEP_TOO_SMALL, STEP_LIMIT, NOT_FINITE, JAMMED, GOING_ON };

enum Contact { AIR, STUCK, SLIPPING };

}  // namespace tarsus
