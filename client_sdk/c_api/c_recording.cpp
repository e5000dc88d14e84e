// The C interface: recordings.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "client_sdk/c_api/handle.h"

using namespace tessera;
using namespace tessera::c_api;

tessera_code tessera_record(tessera_client* handle, const char* file, uint64_t max_bytes) {
  if (handle == nullptr || file == nullptr) return Refuse("client or file: is NULL");
  return Guarded([&] {
    return Report(handle->client->Record(file, max_bytes == 0 ? client::Client::kDefaultRecording_bytes : max_bytes));
  });
}

tessera_code tessera_stop_recording(tessera_client* handle) {
  if (handle == nullptr) return Refuse("client: is NULL");
  return Guarded([&] { return Report(handle->client->StopRecording()); });
}

tessera_code tessera_play(const char* file, tessera_client** out) {
  if (out == nullptr) return Refuse("client: is NULL");
  *out = nullptr;
  if (file == nullptr) return Refuse("file: is NULL");
  return Guarded([&] {
    auto playing = client::Client::Play(file);
    if (!playing.ok()) return Report(playing.status());
    *out = new tessera_client{.client = *std::move(playing), .events = {}, .detail = {}, .property = {}};
    return tessera_code{TESSERA_OK};
  });
}

double tessera_recording_seconds(const tessera_client* handle) {
  if (handle == nullptr) return 0;
  const auto length = handle->client->length();
  return length ? std::chrono::duration<double>(*length).count() : 0;
}

tessera_code tessera_seek(tessera_client* handle, double seconds) {
  if (handle == nullptr) return Refuse("client: is NULL");
  if (!std::isfinite(seconds) || seconds < 0) return Refuse("seconds: must be finite, and not negative");
  const auto length = std::chrono::duration<double>(handle->client->length().value_or(std::chrono::microseconds(0)));
  const std::chrono::duration<double> at(std::min(seconds, length.count()));
  return Guarded(
      [&] { return Report(handle->client->Seek(std::chrono::duration_cast<std::chrono::microseconds>(at))); });
}
