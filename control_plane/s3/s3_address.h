// An address of checkpoints in an object store that speaks S3: "s3://bucket/prefix".
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "absl/status/statusor.h"

namespace tessera::control {

struct S3Address {
  std::string bucket;
  std::string prefix;  // empty, or ends with '/'
};

// True for "s3://...".
bool IsS3Address(const std::string& text);
// INVALID_ARGUMENT says what is wrong: a bucket has 3 to 63 of [a-z0-9.-], a prefix at most 512 of [A-Za-z0-9._/-],
// without an empty part and without "..".
absl::StatusOr<S3Address> ParseS3Address(const std::string& text);

struct S3Settings {
  S3Address address;
  std::string name;      // as the operator wrote it
  std::string endpoint;  // "https://s3.eu-central-1.amazonaws.com", without a '/' at its end
  std::string region;
  std::string access_key, secret_key;
  std::string session_token;  // empty: none
};

// The value of an environment variable; nothing: it is not set.
using Environment = std::function<std::optional<std::string>(const char* name)>;

// The settings of `address`. `endpoint` empty: Amazon's, of the region; `region` empty: AWS_REGION, else us-east-1.
// The asker is in AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, and AWS_SESSION_TOKEN where there is one.
// INVALID_ARGUMENT names the option or variable: an endpoint is https, or http on this machine alone.
absl::StatusOr<S3Settings> MakeS3Settings(const std::string& address, const std::string& endpoint,
                                          const std::string& region, const Environment& environment);

}  // namespace tessera::control
