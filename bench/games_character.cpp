#include "bench/games_character.h"

#include <stdexcept>
#include <string>

#include "client_sdk/prediction_loop.h"

namespace tessera::bench {

namespace prediction = client::prediction;

namespace {

// Mean over walks on networks that lose other messages; one walk along the course is off 3 to 9 times a minute.
void Measure(const char* config, const std::string& more, bool crowded, int networks, double seconds, Report& report) {
  int off = 0;
  for (int seed = 0; seed < networks; ++seed) {
    prediction::Loop loop(prediction::kCourse + more, prediction::kBadNetwork, prediction::kCharacter);
    loop.LoseBy(seed);
    prediction::CrowdedCourse others;
    if (crowded) loop.before_step = [&] { others.MoveOthers(loop); };
    off += prediction::WalkTheCourse(loop, seconds, !crowded).off;
    if (loop.refused > 0) throw std::runtime_error("the region refused inputs");
  }
  report.Add("character", "tessera", config, "character_corrections_per_10s", off * 10 / (networks * seconds), "1");
}

}  // namespace

// 100 ms there and back and 5 % of the messages lost, each way. It counts the times at which the predicted place came
// to be off by more than 1 cm from the server's of the same tick.
void MeasureCharacter(bool quick, Report& report) {
  const int networks = quick ? 1 : 5;
  const double seconds = quick ? 20 : 60;
  Measure("course", "", false, networks, seconds, report);
  Measure("crates and players", prediction::CrowdedCourse::Crates(), true, networks, seconds, report);
}

}  // namespace tessera::bench
