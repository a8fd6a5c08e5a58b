// The age of a contact, by which its strength goes. A foot may keep a part of the age of its contact before.
#pragma once
#include "laws/laws.hpp"

namespace tarsus {

// Of one foot. Real is double, or a Jet with laws of the same.
template <class Real>
struct Grip {
  Real since = Real(0.0);   // [s] when the present contact would have begun had it aged all along
  Real aged = Real(0.0);    // [s] age when the foot last left the ground
  Real parted = Real(0.0);  // [s] when it did

  // Age [s] that a contact would begin with at a time.
  template <class AnyLaws>
  Real brought(AnyLaws& laws, int foot, const Real& time) const {
    return laws.remaining(foot, aged, time - parted);
  }
  template <class AnyLaws>
  void begin(AnyLaws& laws, int foot, const Real& time) {
    since = time - brought(laws, foot, time);
  }
  void end(const Real& time) {
    aged = time - since;
    parted = time;
  }
};

}  // namespace tarsus
