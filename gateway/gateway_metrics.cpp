#include "gateway/gateway_metrics.h"

namespace tessera::gateway {
namespace {

prometheus::Counter& Count(prometheus::Registry& registry, const char* name, const char* help,
                           const prometheus::Labels& labels = {}) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add(labels);
}
prometheus::Gauge& Level(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
}

// Two thousand bodies take some 100 us; at 60 a second a frame that takes 16 ms is the whole processor.
const prometheus::Histogram::BucketBoundaries kFrameBuckets = {20e-6,  50e-6, 100e-6, 200e-6, 400e-6,
                                                               800e-6, 2e-3,  5e-3,   16e-3};
constexpr char kBytesName[] = "tessera_gateway_bytes_total", kBytesHelp[] = "Bytes of messages to viewers.";
constexpr char kMessagesName[] = "tessera_gateway_messages_total", kMessagesHelp[] = "Messages of viewers.";
constexpr char kRefusedName[] = "tessera_gateway_refused_total", kRefusedHelp[] = "Connections that were refused.";
constexpr char kOrdersName[] = "tessera_gateway_orders_total",
               kOrdersHelp[] = "Orders of viewers by what came of them.";

}  // namespace

GatewayMetrics::GatewayMetrics()
    : worlds(Level(*registry, "tessera_gateway_worlds", "Worlds that are watched.")),
      viewers(Level(*registry, "tessera_gateway_viewers", "Viewers that are connected.")),
      players(Level(*registry, "tessera_gateway_players", "Viewers that play, a world or a recording.")),
      connections(Level(*registry, "tessera_gateway_connections", "Connections, of pages and viewers.")),
      recordings(Level(*registry, "tessera_gateway_recordings", "Worlds that are recorded.")),
      frames(Count(*registry, "tessera_gateway_frames_total", "Frames sent to viewers.")),
      frame_bytes(Count(*registry, kBytesName, kBytesHelp, {{"kind", "frame"}})),
      other_bytes(Count(*registry, kBytesName, kBytesHelp, {{"kind", "other"}})),
      late_frames(Count(*registry, "tessera_gateway_late_frames_total",
                        "Times that a frame was due to a viewer that had not read the one before.")),
      limited_frames(Count(*registry, "tessera_gateway_limited_frames_total",
                           "Frames that left bodies out, for the viewer's budget of bytes was spent.")),
      deferred_bodies(Count(*registry, "tessera_gateway_deferred_bodies_total",
                            "Bodies that such a frame left out, for a later one.")),
      messages(Count(*registry, kMessagesName, kMessagesHelp, {{"result", "taken"}})),
      bad_messages(Count(*registry, kMessagesName, kMessagesHelp, {{"result", "bad"}})),
      refused_full(Count(*registry, kRefusedName, kRefusedHelp, {{"reason", "too_many"}})),
      refused_address(Count(*registry, kRefusedName, kRefusedHelp, {{"reason", "too_many_of_address"}})),
      refused_origin(Count(*registry, kRefusedName, kRefusedHelp, {{"reason", "origin"}})),
      orders_done(Count(*registry, kOrdersName, kOrdersHelp, {{"result", "done"}})),
      orders_failed(Count(*registry, kOrdersName, kOrdersHelp, {{"result", "failed"}})),
      orders_refused(Count(*registry, kOrdersName, kOrdersHelp, {{"result", "refused"}})),
      tickets_refused(Count(*registry, "tessera_gateway_tickets_refused_total",
                            "Joins that were refused for want of a ticket, or for one that did not count.")),
      frame_seconds(prometheus::BuildHistogram()
                        .Name("tessera_gateway_frame_seconds")
                        .Help("Time to make a frame.")
                        .Register(*registry)
                        .Add({}, kFrameBuckets)) {}

}  // namespace tessera::gateway
