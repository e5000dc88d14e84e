#include "bench/games_character.h"

#include <stdexcept>

#include "client_sdk/prediction_loop.h"

namespace tessera::bench {

namespace prediction = client::prediction;

// 100 ms there and back and 5 % of the messages lost, each way. It counts the times at which the predicted place came
// to be off by more than 1 cm from the server's of the same tick.
void MeasureCharacter(bool quick, Report& report) {
  const double seconds = quick ? 20 : 60;
  const auto add = [&](const char* config, prediction::Loop& loop, bool jumps) {
    const prediction::Figures figures = prediction::WalkTheCourse(loop, seconds, jumps);
    if (loop.refused > 0) throw std::runtime_error("the region refused inputs");
    report.Add("character", "tessera", config, "character_corrections_per_10s", figures.off * 10 / figures.seconds,
               "1");
  };
  prediction::Loop course(prediction::kCourse, prediction::kBadNetwork, prediction::kCharacter);
  add("course", course, true);
  prediction::Loop crowded(prediction::kCourse + prediction::CrowdedCourse::Crates(), prediction::kBadNetwork,
                           prediction::kCharacter);
  prediction::CrowdedCourse others;
  crowded.before_step = [&] { others.MoveOthers(crowded); };
  add("crates and players", crowded, false);
}

}  // namespace tessera::bench
