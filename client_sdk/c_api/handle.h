// The handles of the C interface. Not for others.
//
// Thread rule: that of tessera.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <deque>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "client_sdk/client.h"
#include "client_sdk/include/tessera/tessera.h"

struct tessera_client {
  std::unique_ptr<tessera::client::Client> client;
  std::deque<tessera::client::ClientEvent> events;
  std::string detail, property;  // those of the event that was given out last
  std::deque<tessera::client::GameEvent> game_events{};
  tessera::client::GameEvent game_event{};  // the one that was given out last
  std::shared_ptr<void> user{};             // from tessera_grant_options
};

namespace tessera::c_api {

// Notes the text for tessera_last_error.
tessera_code Report(const absl::Status& status);
tessera_code Refuse(const char* what);  // TESSERA_INVALID_ARGUMENT
void RefuseSize(const char* argument, std::size_t has, std::size_t least);
tessera_code ReportAs(tessera_code code, const std::string& line);  // one that is none of Abseil's

inline client::TimePoint At(int64_t now_ns) { return client::TimePoint(std::chrono::nanoseconds(now_ns)); }

// The least size of a struct that a program can have meant: through the fields without which it says nothing. A smaller
// one was not set.
template <class T>
inline constexpr std::size_t kLeastSize = 2 * sizeof(uint32_t);
template <>
inline constexpr std::size_t kLeastSize<tessera_body> = offsetof(tessera_body, orientation);
template <>
inline constexpr std::size_t kLeastSize<tessera_body_info> = offsetof(tessera_body_info, mass_kg);
template <>
inline constexpr std::size_t kLeastSize<tessera_event> = offsetof(tessera_event, detail);
template <>
inline constexpr std::size_t kLeastSize<tessera_game_event> = sizeof(tessera_game_event);
template <>
inline constexpr std::size_t kLeastSize<tessera_game_event_field> = sizeof(tessera_game_event_field);
template <>
inline constexpr std::size_t kLeastSize<tessera_grant_options> = offsetof(tessera_grant_options, bind_address);
template <>
inline constexpr std::size_t kLeastSize<tessera_property> = offsetof(tessera_property, text);
template <>
inline constexpr std::size_t kLeastSize<tessera_spawn> = sizeof(tessera_spawn);
template <>
inline constexpr std::size_t kLeastSize<tessera_shape_info> = offsetof(tessera_shape_info, vertices);
template <>
inline constexpr std::size_t kLeastSize<tessera_clock> = sizeof(tessera_clock);
template <>
inline constexpr std::size_t kLeastSize<tessera_visual_info> = sizeof(tessera_visual_info);

// Whether so many bytes are a T; if not, tessera_last_error names the argument.
template <class T>
bool IsSize(std::size_t bytes, const char* argument) {
  if (bytes >= kLeastSize<T>) return true;
  RefuseSize(argument, bytes, kLeastSize<T>);
  return false;
}

// Fields that both sides know; the size stays the program's.
template <class T>
void GiveOut(const T& from, T* to) {
  const uint32_t size = to->size;
  std::memcpy(static_cast<void*>(to), &from, std::min<std::size_t>(size, sizeof(T)));
  to->size = size;
}
// The program's fields, and for what it does not know, what `defaults` says.
template <class T>
T TakeIn(const T* from, T defaults) {
  std::memcpy(static_cast<void*>(&defaults), from, std::min<std::size_t>(from->size, sizeof(T)));
  return defaults;
}

// Nothing that is thrown inside leaves the library.
template <class Call>
tessera_code Guarded(Call call) {
  try {
    return call();
  } catch (const std::exception& thrown) {
    return Report(absl::InternalError(thrown.what()));
  }
}

template <class T, class Call>
T GuardedValue(T otherwise, Call call) {
  try {
    return call();
  } catch (const std::exception& thrown) {
    Report(absl::InternalError(thrown.what()));
    return otherwise;
  }
}

}  // namespace tessera::c_api
