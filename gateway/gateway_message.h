// The JSON messages that a gateway sends; docs/viewer_protocol.md lists their fields.
//
// Texts from outside may hold any bytes: what is not UTF-8 is replaced. Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client_sdk/client.h"
#include "core/replication/region_figures.h"
#include "gateway/recording_folder.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::gateway {

// Why a viewer cannot be shown what it asks for, by the protocol's code.
struct Problem {
  std::string code;  // "no_world"
  std::string text;
  int again_s = 0;  // 0: asking again will not help
};
// For a join that failed, or a world that ended so.
Problem ProblemOf(const absl::Status& status);
// For an instance that has ended; nothing while it goes on.
std::optional<Problem> ProblemOf(const v1::Instance& instance);
std::string ProblemMessage(const Problem& problem);

// Cost of a region's work, as it sends its clients once a second (docs/decisions/0040): the mean of a time that
// it was done, over the last second.
struct RegionWork {
  double broadcast_ms = 0, prediction_ms = 0;
};
RegionWork WorkOf(const replication::RegionFigures& now, const replication::RegionFigures& before);
// A region that the gateway itself hears.
struct HeardRegion {
  std::optional<RegionWork> work;  // nothing before it has sent its figures
};
using HeardRegions = std::map<std::uint32_t, HeardRegion>;  // by number

// `age_s`: how old the figures are. A region that is not heard is dead, and so is one that has no worker: that its
// connection is silent is seen long after the control plane knows.
std::string StatusMessage(const v1::Instance& instance, double age_s, const HeardRegions& heard);
std::string EventsMessage(const std::vector<v1::InstanceEvent>& events);
// Empty for an event that is neither a contact nor a correction of the prediction.
std::string MetMessage(const client::ClientEvent& event);
// The body that a viewer has selected; it is gone where the client does not see it.
std::string DetailMessage(const client::Client& client, BodyId body);
// Values of one property, as JSON, by body.
using PropertyValues = std::map<BodyId, std::string>;
// Values of all bodies that the client sees and that have the property; empty where the scene declares none so named.
PropertyValues ValuesOf(const client::Client& client, const std::string& property);
// Properties of the world itself that every client may see, in the order of their declaration; empty where there are
// none.
std::string WorldMessage(const client::Client& client);
std::string ValuesMessage(const std::string& property, const PropertyValues& values);
// `needs`: the right that the order lacks, "token" or "key"; empty: none.
std::string AnswerMessage(std::uint64_t number, const absl::Status& status, const std::string& text,
                          const std::string& needs = "");

// The state of a recording of the world.
struct RecordingState {
  bool on = false;
  std::string file;  // the newest one's
  std::uint64_t bytes = 0;
  std::string problem;  // why it ended unasked, or could not begin
};
std::string RecordingMessage(const RecordingState& state);
// Where a viewer is in a recording.
struct PlayState {
  std::string file;
  double length_s = 0, at_s = 0, speed = 1;
  bool paused = false;
};
std::string PlayMessage(const PlayState& state);

// /api/recordings
std::string RecordingsPage(const std::vector<ListedRecording>& recordings);
// /api/worlds. `problem`: why the list is not what it should be; empty where it is.
std::string WorldsPage(const std::vector<v1::Instance>& instances, const std::string& problem);

}  // namespace tessera::gateway
