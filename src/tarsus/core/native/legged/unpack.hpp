// A walker's body and legs from named arrays; tarsus.core.arrays says what each is.
#pragma once
#include "base/fields.hpp"
#include "legged/body.hpp"
#include "legged/tables.hpp"

namespace tarsus::legged {

inline Body body_of(const Fields& from) {
  Body out;
  out.mass = from.doubles("body_mass");
  const int nb = out.coordinates();
  if (nb < 2 || nb > MOST_COORDINATES) throw std::invalid_argument("a body has 2 to 16 coordinates");
  out.weight.assign(nb, 0.0);
  out.falls = from.sized("body_weight", DIRECTIONS * nb);
  out.stiffness = from.sized("body_stiffness", nb * nb);
  out.damping = from.sized("body_damping", nb * nb);
  out.lever = from.sized("lever", nb);
  out.leg = from.narrowed<int>("leg");
  out.drive = from.narrowed<int>("drive");
  out.directions = int(from.whole("directions"));
  if (out.directions < DIRECTIONS || out.directions > MOST_DIRECTIONS) throw std::invalid_argument("a leg has 2 or 3 directions");
  const int ways = out.directions;
  out.gain = from.sized("gain", ways * out.drive.size());
  out.load = from.doubles("body_load");
  out.drives = int(out.load.size()) / nb;
  const std::vector<double> mass = from.doubles("mass");
  const size_t legs = mass.size();
  const auto weight = from.sized("weight", legs), gap = from.sized("gap", legs);
  const auto stiffness = from.sized("stiffness", ways * legs), damping = from.sized("damping", ways * legs);
  const auto hip = from.sized("hip", ways * legs * nb);
  const auto kind = from.narrowed<int>("kind"), foot = from.narrowed<int>("foot"), first = from.narrowed<int>("first");
  const auto place = from.sized("place", legs);
  const auto points = from.narrowed<int>("points"), periodic = from.narrowed<int>("periodic"), patched = from.narrowed<int>("patched"), line = from.narrowed<int>("line");
  Fields::check("a line of the ground", periodic.size() == points.size() && patched.size() == points.size() && line.size() == out.leg.size());
  for (size_t n = 0; n < points.size(); n++) {
    if (points[n] < 2) throw std::invalid_argument("a line of the ground has two points at least");
    out.lines.push_back({points[n], periodic[n] != 0, patched[n] != 0, out.shape()});
    out.patched = out.patched || patched[n] != 0;
  }
  Fields::check("a leg", kind.size() == ways * legs && foot.size() == legs && first.size() == legs + 1);
  for (size_t i = 0; i < legs; i++) {
    Leg leg;
    leg.mass = mass[i];
    leg.gap = gap[i];
    leg.place = place[i];
    leg.foot = foot[i];
    leg.first = first[i];
    leg.last = first[i + 1];
    leg.weight[UP] = leg.weight[ALONG] = weight[i];
    for (int d = 0; d < ways; d++) {
      leg.stiffness[d] = stiffness[ways * i + d];
      leg.damping[d] = damping[ways * i + d];
      leg.kind[d] = kind[ways * i + d];
      for (int b = 0; b < nb; b++) {
        const double by = hip[(ways * i + d) * nb + b];
        if (by == 0.0) continue;
        leg.hip[d].at[leg.hip[d].count] = b;
        leg.hip[d].by[leg.hip[d].count++] = by;
      }
    }
    out.legs.push_back(leg);
  }
  for (size_t f = 0; f < out.leg.size() && !out.lines.empty(); f++) {
    if (line[f] < 0 || size_t(line[f]) >= out.lines.size()) throw std::invalid_argument("no such line of the ground");
    out.legs[out.leg[f]].line = line[f];
  }
  return out;
}

}  // namespace tarsus::legged
