// The scenes of the suite `accuracy`: what is run, and what its error is. Inside bench only.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "bench/trial.h"

namespace tessera::bench {

// The error of a run that broke down.
inline constexpr double kBroken = std::numeric_limits<double>::infinity();

struct Outcome {
  struct Part {
    std::string metric;
    double value = 0;
    std::string unit;
  };

  double error = 0;  // infinite if the run broke down
  std::vector<Part> parts;
  double cpu_us = 0;  // by tick
};

enum class Sweep {
  kNone,    // the committed setting at 60 Hz
  kStep,    // step lengths
  kSolver,  // step lengths, substeps, iterations
};

struct AccuracyScene {
  std::string name;
  std::string error_is;  // for the plot's axis
  double floor = 0;
  double worst = 0.1;  // beyond a tenth it is no longer that scene: it has stopped, fallen, torn or blown up
  Sweep sweep = Sweep::kSolver;
  bool mujoco = false;  // one of its rows too
  bool direct = true;   // ODE's direct solver too; it is cubic in the contacts of a pile
  std::function<absl::StatusOr<Outcome>(const Trial&)> run;
};

std::vector<AccuracyScene> FlightScenes();  // 1 to 3
std::vector<AccuracyScene> BallScenes();    // 4 to 7
std::vector<AccuracyScene> SolidScenes();   // 9 to 12

}  // namespace tessera::bench
