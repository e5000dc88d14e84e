// The C interface: recordings.
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
