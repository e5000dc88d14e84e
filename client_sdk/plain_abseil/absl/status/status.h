// absl::Status on the standard library; see README.md. Thread rule: plain values.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <ostream>
#include <string>
#include <string_view>
#include <utility>

namespace absl {

// NOLINTNEXTLINE(performance-enum-size): as in Abseil
enum class StatusCode : int {
  kOk = 0,
  kCancelled = 1,
  kUnknown = 2,
  kInvalidArgument = 3,
  kDeadlineExceeded = 4,
  kNotFound = 5,
  kAlreadyExists = 6,
  kPermissionDenied = 7,
  kResourceExhausted = 8,
  kFailedPrecondition = 9,
  kAborted = 10,
  kOutOfRange = 11,
  kUnimplemented = 12,
  kInternal = 13,
  kUnavailable = 14,
  kDataLoss = 15,
  kUnauthenticated = 16,
};

class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string_view message) : code_(code), message_(code == StatusCode::kOk ? "" : message) {}

  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  std::string_view message() const { return message_; }
  std::string ToString() const {
    return ok() ? "OK" : "status " + std::to_string(static_cast<int>(code_)) + ": " + message_;
  }
  void Update(const Status& other) {
    if (ok()) *this = other;
  }
  friend bool operator==(const Status& a, const Status& b) { return a.code_ == b.code_ && a.message_ == b.message_; }
  friend std::ostream& operator<<(std::ostream& out, const Status& status) { return out << status.ToString(); }

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

inline Status OkStatus() { return {}; }
inline Status AbortedError(std::string_view message) { return {StatusCode::kAborted, message}; }
inline Status AlreadyExistsError(std::string_view message) { return {StatusCode::kAlreadyExists, message}; }
inline Status DataLossError(std::string_view message) { return {StatusCode::kDataLoss, message}; }
inline Status DeadlineExceededError(std::string_view message) { return {StatusCode::kDeadlineExceeded, message}; }
inline Status FailedPreconditionError(std::string_view message) { return {StatusCode::kFailedPrecondition, message}; }
inline Status InternalError(std::string_view message) { return {StatusCode::kInternal, message}; }
inline Status InvalidArgumentError(std::string_view message) { return {StatusCode::kInvalidArgument, message}; }
inline Status NotFoundError(std::string_view message) { return {StatusCode::kNotFound, message}; }
inline Status OutOfRangeError(std::string_view message) { return {StatusCode::kOutOfRange, message}; }
inline Status PermissionDeniedError(std::string_view message) { return {StatusCode::kPermissionDenied, message}; }
inline Status ResourceExhaustedError(std::string_view message) { return {StatusCode::kResourceExhausted, message}; }
inline Status UnauthenticatedError(std::string_view message) { return {StatusCode::kUnauthenticated, message}; }
inline Status UnavailableError(std::string_view message) { return {StatusCode::kUnavailable, message}; }

inline bool IsAlreadyExists(const Status& status) { return status.code() == StatusCode::kAlreadyExists; }
inline bool IsNotFound(const Status& status) { return status.code() == StatusCode::kNotFound; }
inline bool IsResourceExhausted(const Status& status) { return status.code() == StatusCode::kResourceExhausted; }

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
