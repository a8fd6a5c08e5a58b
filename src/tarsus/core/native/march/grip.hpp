// The age of a contact, by which its strength goes. A foot may keep a part of the age of its contact before.
#pragma once
#include "laws/laws.hpp"

namespace tarsus {

// Of one foot.
struct Grip {
  double since = 0.0;   // [s] when the present contact would have begun had it aged all along
  double aged = 0.0;    // [s] age when the foot last left the ground
  double parted = 0.0;  // [s] when it did
  // [s] when a part of a run took it to stick, for it did not move: where friction does not hold it then, it slid before
  double supposed = NOT_A_NUMBER;

  // Age [s] that a contact would begin with at a time.
  double brought(const ActingLaws& laws, int foot, double time) const {
    return laws.remaining(foot, aged, time - parted);
  }
  void begin(const ActingLaws& laws, int foot, double time) {
    since = time - brought(laws, foot, time);
  }
  void end(double time) {
    aged = time - since;
    parted = time;
  }
};

}  // namespace tarsus
