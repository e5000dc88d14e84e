#include "bench/snapshots.h"

#include <deque>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "bench/acceptor.h"
#include "bench/snapshots_net.h"
#include "bench/snapshots_packer.h"
#include "bench/snapshots_scale.h"
#include "bench/snapshots_trace.h"
#include "bench/statistics.h"
#include "bench/thread_cpu.h"
#include "core/replication/codec/dense_codec.h"
#include "core/replication/codec/fast_list.h"
#include "core/replication/snapshot.h"

namespace tessera::bench {
namespace {

using namespace replication;

constexpr double kRate_hz = 60;
constexpr std::size_t kAge = 6;             // ticks from a snapshot to its baseline: 100 ms of round trip
constexpr std::size_t kGap = 2, kGap2 = 3;  // to the older samples that predict
// The dense coder's: the newest motion, and one so old that what rounding does to it shows.
constexpr std::size_t kDenseGap = 1, kDenseGap2 = 5;
constexpr std::size_t kFirst = kAge + kGap + kGap2 + 1;
static_assert(kAge + kDenseGap + kDenseGap2 <= kFirst);
constexpr double kGravity_m_s2 = -20;

// As in the reference, rates count what is sent of the cubes: sequence numbers, ticks and checksums come on top, much
// the same for all coders. Of a dense frame those are format, three references, tick and checksum.
constexpr std::size_t FrameHeaderBytes(Tick tick) { return 1 + 3 + (tick.value() < 128 ? 1 : 2) + 4; }

// One codec over the whole trace.
struct Cost {
  std::vector<double> bytes, encode_us, decode_us;  // a snapshot
  std::size_t changed = 0;                          // cubes that differ from their baseline, over all snapshots
  PackedBits bits;

  double mean_bytes() const {
    return std::accumulate(bytes.begin(), bytes.end(), 0.0) / static_cast<double>(bytes.size());
  }
};

class Rows {
 public:
  Rows(std::string scene, Report& report) : scene_(std::move(scene)), report_(report) {}
  void Add(const std::string& config, const std::string& metric, double value, const std::string& unit) {
    report_.Add(scene_, "tessera", config, metric, value, unit);
  }
  void AddRates(const std::string& config, const Cost& cost) {
    const auto kbps = [](double bytes) { return bytes * 8 * kRate_hz / 1000; };
    Add(config, "kbps_mean", kbps(cost.mean_bytes()), "kbit/s");
    Add(config, "kbps_p50", kbps(Median(cost.bytes)), "kbit/s");
    Add(config, "kbps_p95", kbps(Quantile(cost.bytes, 0.95)), "kbit/s");
    Add(config, "kbps_max", kbps(Quantile(cost.bytes, 1)), "kbit/s");
    Add(config, "bits_a_changed_cube",
        cost.mean_bytes() * 8 * static_cast<double>(cost.bytes.size()) /
            std::max(1.0, static_cast<double>(cost.changed)),
        "bits");
    if (!cost.encode_us.empty()) Add(config, "encode_us_p50", Median(cost.encode_us), "us");
    if (!cost.decode_us.empty()) Add(config, "decode_us_p50", Median(cost.decode_us), "us");
  }

 private:
  std::string scene_;
  Report& report_;
};

std::size_t CountChanged(const CubeStates& now, const CubeStates& base) {
  std::size_t changed = 0;
  for (std::size_t i = 0; i < now.size(); ++i) changed += now[i] != base[i] ? 1 : 0;
  return changed;
}

absl::Status Differs(const char* coder, std::size_t tick) {
  return absl::InternalError(absl::StrCat(coder, ": what was read at tick ", tick, " is not what was written"));
}

absl::StatusOr<Cost> RunPacker(const CubeTrace& trace, PackerStep step) {
  Cost cost;
  for (std::size_t t = kFirst; t < trace.ticks.size(); ++t) {
    const CubeStates &now = trace.ticks[t], &base = trace.ticks[t - kAge];
    const double begin = ThreadCpuSeconds();
    BitWriter writer;
    const PackedBits bits = PackCubes(writer, step, now, base);
    const Bytes bytes = writer.Finish();
    const double written = ThreadCpuSeconds();
    cost.encode_us.push_back((written - begin) * 1e6);
    if (bytes.size() != (bits.total() + 7) / 8) return absl::InternalError("bit packer: miscounted its bits");
    if (step == PackerStep::kRelativeOrientation) {
      CubeStates got;
      const bool ok = UnpackCubes(bytes, base, got);
      cost.decode_us.push_back((ThreadCpuSeconds() - written) * 1e6);
      if (!ok || got != now) return Differs("bit packer", t);
    }
    cost.bytes.push_back(static_cast<double>(bytes.size()));
    cost.changed += CountChanged(now, base);
    cost.bits.index += bits.index;
    cost.bits.position += bits.position;
    cost.bits.orientation += bits.orientation;
  }
  return cost;
}

// The fast coder: id, samples and record of each changed cube.
class FastPass {
 public:
  FastPass(const CubeTrace& trace, const Quantizer& quantizer, const PosePredictor& predictor)
      : trace_(trace), quantizer_(quantizer), predictor_(predictor) {}

  absl::StatusOr<Cost> Run() {
    Cost cost;
    for (std::size_t t = kFirst; t < trace_.ticks.size(); ++t) {
      const double begin = ThreadCpuSeconds();
      Pack(t);
      const double packed = ThreadCpuSeconds();
      const Bytes bytes = Assemble();
      const double assembled = ThreadCpuSeconds();
      CubeStates got;
      const bool ok = Read(bytes, t, got);
      cost.decode_us.push_back((ThreadCpuSeconds() - assembled) * 1e6);
      if (!ok || got != trace_.ticks[t]) return Differs("fast coder", t);
      cost.encode_us.push_back((assembled - begin) * 1e6);
      shared_us.push_back((assembled - packed) * 1e6);
      cost.bytes.push_back(static_cast<double>(bytes.size()));
      cost.changed += records_.size();
    }
    return cost;
  }
  std::vector<double> shared_us;  // time of a further client with the same baselines

 private:
  Prediction Predict(std::size_t t, std::size_t cube) const {
    return predictor_.Predict({.base = &trace_.ticks[t - kAge][cube],
                               .older = &trace_.ticks[t - kAge - kGap][cube],
                               .oldest = &trace_.ticks[t - kAge - kGap - kGap2][cube],
                               .ticks = kAge,
                               .gap = kGap,
                               .gap2 = kGap2});
  }
  void Pack(std::size_t t) {
    records_.clear();
    const CubeStates &now = trace_.ticks[t], &base = trace_.ticks[t - kAge];
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] == base[i]) continue;
      records_.emplace_back(i, PackPose(Predict(t, i), base[i], now[i], quantizer_.orientation_limit()));
    }
  }
  Bytes Assemble() {
    items_.clear();
    for (const auto& [cube, record] : records_)
      items_.push_back({BodyId(cube + 1), {kAge, kGap, kGap2}, record.view()});
    BitWriter writer;
    WriteFastList(writer, items_);
    return writer.Finish();
  }
  bool Read(const Bytes& bytes, std::size_t t, CubeStates& got) const {
    BitReader reader(bytes);
    got = trace_.ticks[t - kAge];
    FastListReader list(reader);
    BodyId id;
    SampleTicks samples;
    while (list.Next(id, samples)) {
      if (id.value() > got.size() || samples != SampleTicks{kAge, kGap, kGap2}) return false;
      const std::size_t cube = id.value() - 1;
      const QuantizedState& base = trace_.ticks[t - kAge][cube];
      if (!ReadPose(reader, Predict(t, cube), base, quantizer_.orientation_limit(), got[cube])) return false;
    }
    return list.ok() && reader.AtEnd();
  }

  const CubeTrace& trace_;
  const Quantizer& quantizer_;
  const PosePredictor& predictor_;
  std::vector<std::pair<std::size_t, PackedRecord>> records_;
  std::vector<FastItem> items_;
};

DenseFrame FrameOf(const CubeTrace& trace, std::size_t t) {
  DenseFrame frame{.tick = Tick(t + 1), .bodies = {}, .departures = {}};
  for (std::size_t i = 0; i < trace.ticks[t].size(); ++i) {
    frame.bodies.push_back({BodyId(i + 1), Epoch(1), trace.ticks[t][i]});
  }
  return frame;
}

// `age` 1 with the two before it: a recording. 6: a thin link of 100 ms. With `boxes` both ends know the scene's ground
// and the sizes of the cubes.
absl::StatusOr<Cost> RunDense(const CubeTrace& trace, std::size_t age, std::size_t gap, std::size_t gap2, bool boxes) {
  const DenseCodec codec = MakeDenseCodec(CubeBounds(), CubeSettings(), kGravity_m_s2, false,
                                          boxes ? std::make_shared<const StandingBoxes>(CubeBoxes()) : nullptr);
  std::deque<DenseCodec::KeptPtr> sent, got;  // the newest first
  const auto at = [](const std::deque<DenseCodec::KeptPtr>& kept, std::size_t back) {
    return back <= kept.size() ? kept[back - 1] : nullptr;
  };
  Cost cost;
  for (std::size_t t = 0; t < trace.ticks.size(); ++t) {
    DenseFrame frame = FrameOf(trace, t);
    const double begin = ThreadCpuSeconds();
    const DenseCodec::Encoded encoded = codec.Encode(
        std::move(frame), {.base = at(sent, age), .older = at(sent, age + gap), .oldest = at(sent, age + gap + gap2)});
    const double written = ThreadCpuSeconds();
    const auto decoded = codec.Decode(encoded.bytes, [&](Tick tick) {
      const auto back = static_cast<std::size_t>(encoded.kept->frame.tick - tick);
      return at(got, back);
    });
    const double read = ThreadCpuSeconds();
    if (!decoded.ok()) return decoded.status();
    if ((*decoded)->frame.bodies != FrameOf(trace, t).bodies) return Differs("dense coder", t);
    sent.push_front(encoded.kept);
    got.push_front(*decoded);
    if (sent.size() > age + gap + gap2) sent.pop_back();
    if (got.size() > age + gap + gap2) got.pop_back();
    if (t < kFirst) continue;  // as the others
    cost.bytes.push_back(static_cast<double>(encoded.bytes.size() - FrameHeaderBytes(encoded.kept->frame.tick)));
    cost.encode_us.push_back((written - begin) * 1e6);
    cost.decode_us.push_back((read - written) * 1e6);
    cost.changed += CountChanged(trace.ticks[t], trace.ticks[t - age]);
  }
  return cost;
}

// Bytes that a client gets of 901 sleeping cubes, by the sender that serves it, once it has acknowledged them.
absl::StatusOr<double> RestKbps(double seconds) {
  const Quantizer quantizer(CubeBounds(), CubeSettings());
  const CubeTrace trace = RecordCubes(4, CubeDrive::kNone, 1);
  if (trace.moving_share.back() > 0) return absl::InternalError("rest: after 4 s cubes still move");
  std::vector<BodyRecord> bodies;
  for (std::size_t i = 0; i < CubeTrace::kCubes; ++i) {
    bodies.push_back({BodyId(i + 1), Epoch(1), quantizer.Dequantize(trace.ticks.back()[i])});
  }
  SnapshotHistory history(CubeBounds(), CubeSettings());
  SnapshotSender sender(CubeSettings());
  SnapshotReceiver receiver(CubeBounds(), CubeSettings());
  std::size_t bytes = 0;
  constexpr int kSettle = 60;
  const int ticks = static_cast<int>(seconds * kRate_hz);
  for (int n = 1; n <= kSettle + ticks; ++n) {
    history.Push(Tick(static_cast<std::uint64_t>(n)), bodies, {});
    for (const Bytes& datagram : sender.Write(history, 0, 0).datagrams) {
      if (n > kSettle) bytes += datagram.size();
      if (!receiver.Read(datagram).ok()) return absl::InternalError("rest: a datagram was refused");
    }
    if (absl::Status status = sender.Acknowledge(receiver.WriteAck()); !status.ok()) return status;
  }
  return static_cast<double>(bytes) * 8 / seconds / 1000;
}

absl::StatusOr<Cost> AddPackerRows(const CubeTrace& trace, Rows& rows) {
  for (const FixedStep& step : FixedSteps()) {
    rows.Add(step.name, "bits_a_cube", step.bits_a_cube, "bits");
    rows.Add(step.name, "kbps_mean", step.bits_a_cube * static_cast<double>(CubeTrace::kCubes) * kRate_hz / 1000,
             "kbit/s");
  }
  constexpr std::pair<const char*, PackerStep> kSteps[] = {{"changed bit", PackerStep::kChangedBit},
                                                           {"relative index", PackerStep::kRelativeIndex},
                                                           {"relative position", PackerStep::kRelativePosition},
                                                           {"bit packer", PackerStep::kRelativeOrientation}};
  absl::StatusOr<Cost> cost;
  for (const auto& [name, step] : kSteps) {
    cost = RunPacker(trace, step);
    if (!cost.ok()) return cost;
    rows.AddRates(name, *cost);
  }
  const auto changed = static_cast<double>(cost->changed);
  rows.Add("bit packer", "index_bits_a_cube", static_cast<double>(cost->bits.index) / changed, "bits");
  rows.Add("bit packer", "position_bits_a_cube", static_cast<double>(cost->bits.position) / changed, "bits");
  rows.Add("bit packer", "orientation_bits_a_cube", static_cast<double>(cost->bits.orientation) / changed, "bits");
  return cost;
}

absl::Status RunCubes(const SuiteOptions& options, Report& report) {
  const CubeTrace trace = RecordCubes(options.quick ? 8 : 54, CubeDrive::kMixed, 1);
  Rows rows("cubes901", report);
  rows.Add("trace", "moving_share",
           std::accumulate(trace.moving_share.begin(), trace.moving_share.end(), 0.0) /
               static_cast<double>(trace.moving_share.size()),
           "1");
  rows.Add("trace", "position_error_m_p50", trace.position_error_p50_m, "m");
  rows.Add("trace", "position_error_m_max", trace.position_error_max_m, "m");
  rows.Add("trace", "angle_error_deg_mean", trace.angle_error_mean_deg, "deg");
  rows.Add("trace", "angle_error_deg_max", trace.angle_error_max_deg, "deg");
  const absl::StatusOr<Cost> packer = AddPackerRows(trace, rows);
  if (!packer.ok()) return packer.status();

  const auto add = [&](const std::string& config, const absl::StatusOr<Cost>& cost) {
    if (!cost.ok()) return cost.status();
    rows.AddRates(config, *cost);
    rows.Add(config, "bytes_ratio_to_bitpacker", cost->mean_bytes() / packer->mean_bytes(), "1");
    return absl::OkStatus();
  };
  const Quantizer quantizer(CubeBounds(), CubeSettings());
  const PosePredictor predictor(quantizer, CubeSettings(), kGravity_m_s2);
  FastPass fast(trace, quantizer, predictor);
  if (absl::Status status = add("coder=fast", fast.Run()); !status.ok()) return status;
  rows.Add("coder=fast", "encode_shared_us_p50", Median(fast.shared_us), "us");
  if (absl::Status status = add("coder=dense", RunDense(trace, kAge, kDenseGap, kDenseGap2, true)); !status.ok())
    return status;
  if (absl::Status status = add("dense without the scene", RunDense(trace, kAge, kDenseGap, kDenseGap2, false));
      !status.ok()) {
    return status;
  }
  if (absl::Status status = add("recording", RunDense(trace, 1, 1, 1, true)); !status.ok()) return status;

  const absl::StatusOr<double> rest = RestKbps(options.quick ? 5 : 20);
  if (!rest.ok()) return rest.status();
  rows.Add("live", "rest_kbps", *rest, "kbit/s");
  return absl::OkStatus();
}

// The same scene driven otherwise: whether the ratios hang on one trace.
absl::Status RunSeeds(const SuiteOptions& options, Report& report) {
  const Quantizer quantizer(CubeBounds(), CubeSettings());
  const PosePredictor predictor(quantizer, CubeSettings(), kGravity_m_s2);
  for (unsigned seed = 2; seed <= (options.quick ? 2u : 5u); ++seed) {
    const CubeTrace trace = RecordCubes(options.quick ? 8 : 27, CubeDrive::kMixed, seed);
    const absl::StatusOr<Cost> packer = RunPacker(trace, PackerStep::kRelativeOrientation);
    if (!packer.ok()) return packer.status();
    FastPass pass(trace, quantizer, predictor);
    const absl::StatusOr<Cost> fast = pass.Run();
    if (!fast.ok()) return fast.status();
    const absl::StatusOr<Cost> dense = RunDense(trace, kAge, kDenseGap, kDenseGap2, true);
    if (!dense.ok()) return dense.status();
    Rows rows(absl::StrCat("seed ", seed), report);
    rows.Add("bit packer", "kbps_mean", packer->mean_bytes() * 8 * kRate_hz / 1000, "kbit/s");
    rows.Add("coder=fast", "bytes_ratio_to_bitpacker", fast->mean_bytes() / packer->mean_bytes(), "1");
    rows.Add("coder=dense", "bytes_ratio_to_bitpacker", dense->mean_bytes() / packer->mean_bytes(), "1");
  }
  return absl::OkStatus();
}

struct SnapshotScene {
  const char* name;
  absl::Status (*run)(const SuiteOptions&, Report&);
};

constexpr SnapshotScene kScenes[] = {{"cubes901", RunCubes},   {"seeds", RunSeeds},   {"loss", RunLoss},
                                     {"join", RunJoin},        {"render", RunRender}, {"scale", RunScale},
                                     {"acceptor", RunAcceptor}};

}  // namespace

absl::Status RunSnapshots(const SuiteOptions& options, Report& report) {
  for (const SnapshotScene& scene : kScenes) {
    if (std::string(scene.name).find(options.only) == std::string::npos) continue;
    if (absl::Status status = scene.run(options, report); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
