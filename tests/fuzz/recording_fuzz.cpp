// A recording: as a file of any bytes, and as entries under seals that are right, so that their readers are reached.
// The first byte chooses.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <sstream>

#include "client_sdk/recording.h"
#include "client_sdk/recording_format.h"
#include "client_sdk/replay.h"
#include "core/replication/codec/checksum.h"
#include "core/world/byte_view.h"
#include "core/world/bytes.h"
#include "core/world/packed_scene.h"
#include "core/world/scene_load.h"

namespace {

using namespace tessera;
using namespace tessera::client;
using replication::Bytes;

RecordingHeader MakeHeader() {
  const auto loaded =
      LoadScene(SceneForm::kText, R"(name: "f" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
    bodies { id: 1 mass: 1 shape { sphere { radius: 0.5 } } })",
                "fuzz");
  const auto map = MakeGridMap(loaded->scene->ground(), 2);
  return {.instance_id = "f",
          .player = PlayerNumber(1),
          .tick_rate_hz = 60,
          .snapshot_rate_hz = 30,
          .started = true,
          .map = WrittenMap(*map),
          .scene = std::string(AsText(PackScene(*loaded->scene)))};
}

void PutWord(std::string& out, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<char>(word >> (8 * i)));
}

// Payloads one after the other, each after its length in two bytes.
std::string Sealed(std::span<const std::uint8_t> bytes) {
  static const Bytes header = EncodeHeader(MakeHeader());
  std::string file;
  PutWord(file, kRecordingMagic);
  PutWord(file, kRecordingFormat);
  std::uint32_t entries = 0;
  const auto put = [&](std::span<const std::uint8_t> payload) {
    PutWord(file, static_cast<std::uint32_t>(payload.size()));
    PutWord(file, replication::Crc32c(payload, entries++));
    file.append(payload.begin(), payload.end());
  };
  put(header);
  while (bytes.size() > 2) {
    const std::size_t size = std::min<std::size_t>(bytes[0] | bytes[1] << 8, bytes.size() - 2);
    if (size > 0) put(bytes.subspan(2, size));
    bytes = bytes.subspan(2 + size);
  }
  // The time of the last entry is not known here, so the end is at the latest there is.
  ByteWriter end;
  end.U8(0);
  end.Varint(kMaxTime_us);
  end.Varint(entries);
  put(end.bytes());
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  const std::string file = data[0] % 2 == 0 ? std::string(bytes.begin(), bytes.end()) : Sealed(bytes);
  auto reader = RecordingReader::Open(std::make_unique<std::istringstream>(file), "fuzz");
  if (!reader.ok()) return 0;
  auto replay = Replay::Open(*std::move(reader), "fuzz");
  if (!replay.ok()) return 0;
  const TimePoint begin{std::chrono::hours(1)};
  // From its beginning, or from the last key in its first days.
  if (data[0] % 4 >= 2) replay->Seek(std::chrono::hours(100));
  (void)replay->Next(begin);
  for (;;) {
    const auto step = replay->Next(begin + std::chrono::microseconds(2 * kMaxTime_us));
    if (!step.ok() || !step->has_value()) return 0;
    const auto* snapshot = std::get_if<Replay::Snapshot>(&(*step)->what);
    if (snapshot == nullptr) continue;
    for (const replication::BodyRecord& body : snapshot->received.bodies) {
      if (!IsFinite(body.state.position) || !IsFinite(body.state.orientation)) std::abort();
    }
  }
}
