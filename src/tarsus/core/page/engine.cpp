// The engine as a page calls it: a packet is read where it stands in memory, and what a run leaves stays where it is until the next.
//
// What is refused, or fails, traps: `trouble` says why, and the instance is to be made anew.
#include <cstdlib>
#include <cstring>
#include <exception>

#include "packet/packaged.hpp"

#define TARSUS_OUT(name) extern "C" __attribute__((export_name(#name)))

namespace {
const char* message = "";
}

// No exceptions here: the words of the first are kept. All that the engine throws are std::exception first of all.
extern "C" void* __cxa_allocate_exception(size_t size) { return std::malloc(size); }
extern "C" void __cxa_throw(void* thrown, void*, void (*)(void*)) {
  message = static_cast<std::exception*>(thrown)->what();
  __builtin_trap();
}

using tarsus::Packaged;

TARSUS_OUT(trouble) const char* trouble() { return message; }
TARSUS_OUT(reserve) char* reserve(size_t bytes) { return static_cast<char*>(std::malloc(bytes)); }
TARSUS_OUT(plan) Packaged* plan(char* packet, size_t bytes) { return new Packaged(packet, bytes); }
TARSUS_OUT(duration) double duration(Packaged* plan) { return plan->duration(); }
// Runs until ``end`` [s] with samples at ``count`` times, and where ``seen`` with what a page shows there; returns the code, or -1 where it
// cannot start.
TARSUS_OUT(run) int run(Packaged* plan, const double* times, int count, int seen, double end) {
  plan->until(end);
  const std::vector<double> at(times, times + count);
  seen ? plan->show(at) : plan->run(at);
  return plan->refused.empty() ? plan->code : -1;
}
TARSUS_OUT(finish) const double* finish(Packaged* plan) { return plan->finish; }
TARSUS_OUT(events) const double* events(Packaged* plan) { return reinterpret_cast<const double*>(plan->events.data()); }
TARSUS_OUT(event_numbers) size_t event_numbers(Packaged* plan) { return plan->events.size() * tarsus::EVENT_WIDTH; }
TARSUS_OUT(samples) const double* samples(Packaged* plan) { return plan->samples.data(); }
TARSUS_OUT(sample_width) size_t sample_width(Packaged* plan) { return plan->width; }
TARSUS_OUT(frames) const double* frames(Packaged* plan) { return plan->frames.data(); }
TARSUS_OUT(frame_numbers) size_t frame_numbers(Packaged* plan) { return plan->frames.size(); }
TARSUS_OUT(frame_width) size_t frame_width(Packaged* plan) { return plan->seen_width; }
// Value, spread and n of each measure.
TARSUS_OUT(measures) const double* measures(Packaged* plan) {
  static std::vector<double> out;
  out.clear();
  for (const auto& one : plan->measures) out.insert(out.end(), {one.value, one.spread, double(one.n)});
  return out.data();
}
TARSUS_OUT(measure_numbers) size_t measure_numbers(Packaged* plan) { return 3 * plan->measures.size(); }
TARSUS_OUT(marks) const double* marks(Packaged* plan) { return plan->marks.data(); }
TARSUS_OUT(mark_numbers) size_t mark_numbers(Packaged* plan) { return plan->marks.size(); }
TARSUS_OUT(refusals) const double* refusals(Packaged* plan) { return reinterpret_cast<const double*>(plan->refused.data()); }
TARSUS_OUT(refusal_numbers) size_t refusal_numbers(Packaged* plan) { return 4 * plan->refused.size(); }
