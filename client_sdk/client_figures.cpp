#include "client_sdk/client_figures.h"

#include <algorithm>

namespace tessera::client {
namespace {

constexpr std::chrono::milliseconds kTrafficWindow{1000}, kTrafficStep{50};

}  // namespace

void ClientFigures::BeginPoll(std::optional<std::chrono::nanoseconds> since_last) {
  if (since_last) frame_time_.Add(*since_last);
  work_ = 0;
}

void ClientFigures::Work(std::int64_t units) {
  work_ += units;
  most_ = std::max(most_, work_);
}

void ClientFigures::TookRecords(std::uint64_t full, std::uint64_t delta) {
  full_records_ += full;
  delta_records_ += delta;
}

void ClientFigures::Dropped(const RegionStats& connection) {
  dropped_.datagrams += connection.datagrams;
  dropped_.datagrams_lost += connection.datagrams_lost;
  dropped_.datagrams_passed_over += connection.datagrams_passed_over;
  dropped_.decode_errors += connection.decode_errors;
  dropped_.reconnects += connection.reconnects;
}

void ClientFigures::MeasureRates(TimePoint now) {
  if (!traffic_.empty() && now - traffic_.back().time < kTrafficStep) return;
  traffic_.push_back({now, bytes_in_, bytes_out_});
  while (now - traffic_.front().time > kTrafficWindow) traffic_.pop_front();
}

void ClientFigures::AddTo(ClientStats& stats) const {
  stats.bytes_in = bytes_in_;
  stats.bytes_out = bytes_out_;
  if (traffic_.size() > 1) {
    const double span_s = std::chrono::duration<double>(traffic_.back().time - traffic_.front().time).count();
    stats.bytes_in_per_s = static_cast<double>(traffic_.back().in - traffic_.front().in) / span_s;
    stats.bytes_out_per_s = static_cast<double>(traffic_.back().out - traffic_.front().out) / span_s;
  }
  stats.datagrams_lost += dropped_.datagrams_lost;
  stats.datagrams_passed_over += dropped_.datagrams_passed_over;
  stats.decode_errors += dropped_.decode_errors;
  stats.reconnects += dropped_.reconnects;
  stats.full_records = full_records_;
  stats.delta_records = delta_records_;
  stats.inputs_refused = inputs_refused_;
  stats.work_units = work_;
  stats.most_work_units = most_;
  stats.frame_time = frame_time_.Summary();
  stats.network_time = network_time_.Summary();
  stats.update_time = update_time_.Summary();
}

}  // namespace tessera::client
