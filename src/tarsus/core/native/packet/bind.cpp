// Packets from Python: a plan run as a page runs it.
#include "base/convert.hpp"
#include "packet/packaged.hpp"

namespace tarsus {

namespace {

// A packaged plan with a copy of its packet.
struct OwnPackaged {
  std::vector<double> memory;  // of eights of bytes
  Packaged plan;

  explicit OwnPackaged(const nb::bytes& packet) : memory((packet.size() + 7) / 8), plan(filled(packet), packet.size()) {}

 private:
  char* filled(const nb::bytes& packet) {
    std::memcpy(memory.data(), packet.data(), packet.size());
    return reinterpret_cast<char*>(memory.data());
  }
};

// Code; end time, steps, rejected steps; events, samples at the times, marks of a walker; why it could not start.
nb::tuple run_packaged(OwnPackaged& own, const Doubles& times) {
  Packaged& plan = own.plan;
  plan.run(copied(times));
  return nb::make_tuple(plan.code, returned(std::vector<double>(plan.finish, plan.finish + 3)), returned_rows(std::vector<Event>(plan.events)),
                        returned(std::vector<double>(plan.samples), plan.width), returned(std::vector<double>(plan.marks)),
                        returned_rows(std::vector<Refusal>(plan.refused)));
}

// Code, events, rows of what a page shows at the times (see PageSamples), and measures: value, spread and n of each.
nb::tuple show_packaged(OwnPackaged& own, const Doubles& times) {
  own.plan.show(copied(times));
  std::vector<double> measures;
  for (const measure::Summary& one : own.plan.measures) measures.insert(measures.end(), {one.value, one.spread, double(one.n)});
  return nb::make_tuple(own.plan.code, returned_rows(std::vector<Event>(own.plan.events)), returned(std::vector<double>(own.plan.frames), own.plan.seen_width), returned(std::move(measures), 3));
}

}  // namespace

void bind_packet(nb::module_& m) {
  for (const bool walks : {false, true}) {
    nb::list names;
    for (const char* name : measure_names(walks)) names.append(name);
    m.attr(walks ? "WALK_MEASURES" : "FOOT_MEASURES") = nb::tuple(names);
  }
  nb::class_<OwnPackaged>(m, "Packaged").def(nb::init<const nb::bytes&>()).def("run", &run_packaged).def("show", &show_packaged);
}

}  // namespace tarsus
