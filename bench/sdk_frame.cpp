// The instructions of a client's frame, alone and against another version's.
#include <fmt/format.h>

#include <cstdlib>
#include <iostream>
#include <string>

#include "absl/status/statusor.h"
#include "bench/callgrind.h"
#include "bench/sdk.h"

namespace tessera::bench {
namespace {

absl::StatusOr<double> InstructionsOfFrame(const std::string& program, int frames) {
  const absl::StatusOr<std::uint64_t> counted =
      CountInstructions({program, std::to_string(frames)}, {Counted::Where::kInside, "tessera::bench::DrawFrame(*"});
  if (!counted.ok()) return counted.status();
  return static_cast<double>(*counted) / frames;
}

}  // namespace

absl::Status MeasureFrame(bool quick, Report& report) {
  const int frames = quick ? 60 : 600;
  const absl::StatusOr<double> ours = InstructionsOfFrame(TESSERA_SDK_FRAME, frames);
  if (!ours.ok()) return ours.status();
  const std::string config = "bodies=2000";
  report.Add("frame", "tessera", config, "frame_instructions", *ours, "1");
  const char* const other = std::getenv(kOtherFrameEnvironment);
  if (other == nullptr || *other == '\0') {
    std::cerr << "sdk: frame: no ratio; it needs " << kOtherFrameEnvironment
              << "=PATH/tessera-frame of the version to compare with\n";
    return absl::OkStatus();
  }
  const absl::StatusOr<double> theirs = InstructionsOfFrame(other, frames);
  if (!theirs.ok()) return theirs.status();
  report.Add("frame", "tessera", config, "frame_instructions_ratio", *ours / *theirs, "1");
  std::cerr << fmt::format("sdk: frame: {:.0f} against {:.0f} instructions, ratio {:.4f}\n", *ours, *theirs,
                           *ours / *theirs);
  return absl::OkStatus();
}

}  // namespace tessera::bench
