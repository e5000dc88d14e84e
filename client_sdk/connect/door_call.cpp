#include "client_sdk/connect/door_call.h"

#include <curl/curl.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace tessera::client {
namespace {

using DoorClock = std::chrono::steady_clock;

// The name in certificates of a cluster's own authority (trust/certificate.h).
constexpr char kDoorName[] = "control.tessera.internal";
constexpr std::size_t kMostCertificates = 16, kMostCertificateBytes = 64 * 1024, kShownDigits = 16;

struct FreeCurl {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using CurlHandle = std::unique_ptr<CURL, FreeCurl>;
using ListHandle = std::unique_ptr<curl_slist, FreeCurl>;

absl::Status DoorFault(absl::StatusCode code, const DoorAddress& address, absl::string_view why) {
  return {code, absl::StrCat(AtDoor(address), why)};
}

absl::Status NotTheCluster(const DoorAddress& address) {
  if (address.fingerprint.empty()) {
    return DoorFault(absl::StatusCode::kUnauthenticated, address,
                     "its certificate is of no authority that this system knows, or not for this name; name the "
                     "cluster's authority, HOST:PORT#FINGERPRINT, as `tessera cluster authority` prints it");
  }
  return DoorFault(absl::StatusCode::kUnauthenticated, address,
                   absl::StrCat("what answers is not the cluster whose authority was named, with fingerprint ",
                                address.fingerprint.substr(0, kShownDigits), "…"));
}

std::string InBrackets(const std::string& host) {
  return host.find(':') == std::string::npos ? host : absl::StrCat("[", host, "]");
}

// The answer as it comes, up to the bound.
struct Received {
  std::string body;
  bool too_long = false;
};

std::size_t Receive(const char* bytes, std::size_t size, std::size_t count, void* user) {
  Received& received = *static_cast<Received*>(user);
  const std::size_t all = size * count;
  if (all > kMaxDoorAnswerBytes - received.body.size()) {
    received.too_long = true;
    return 0;  // ends the transfer
  }
  received.body.append(bytes, all);
  return all;
}

// A transfer over TCP or the socket, and what it has to say of a failure.
class Transfer {
 public:
  // It ends at `until`, and is connected by `reached_by`.
  Transfer(const DoorAddress& address, DoorClock::time_point until, DoorClock::time_point reached_by)
      : address_(address), until_(until), reached_by_(std::min(reached_by, until)) {
    static const CURLcode begun = curl_global_init(CURL_GLOBAL_DEFAULT);
    if (begun != CURLE_OK) return;
    curl_.reset(curl_easy_init());
    if (!curl_) return;
    Set(CURLOPT_NOSIGNAL, 1L);    // the process is a game's
    Set(CURLOPT_QUICK_EXIT, 1L);  // a look-up of a name that goes on holds nobody up
    Set(CURLOPT_PROXY, "");       // an environment's proxy is not for this
    Set(CURLOPT_PROTOCOLS_STR, "http,https");
    Set(CURLOPT_HTTP_VERSION, long{CURL_HTTP_VERSION_1_1});
    Set(CURLOPT_SSLVERSION, long{CURL_SSLVERSION_TLSv1_2});
    Set(CURLOPT_ERRORBUFFER, said_.data());
    Set(CURLOPT_WRITEFUNCTION, &Receive);
    Set(CURLOPT_WRITEDATA, &received_);
    if (address.is_socket()) Set(CURLOPT_UNIX_SOCKET_PATH, address.socket.c_str());
  }

  CURL* get() const { return curl_.get(); }
  Received& received() { return received_; }

  // An option that cannot be set makes the transfer fail rather than go out otherwise than was meant.
  template <class Value>
  void Set(CURLoption option, Value value) {
    if (curl_ && set_ == CURLE_OK) set_ = curl_easy_setopt(curl_.get(), option, value);
  }

  // For what only some of the libraries of TLS have: without it there is nothing to set.
  template <class Value>
  void SetWherePossible(CURLoption option, Value value) {
    if (!curl_ || set_ != CURLE_OK) return;
    const CURLcode code = curl_easy_setopt(curl_.get(), option, value);
    if (code != CURLE_NOT_BUILT_IN && code != CURLE_UNKNOWN_OPTION) set_ = code;
  }

  absl::Status Perform() {
    if (!curl_) return DoorFault(absl::StatusCode::kInternal, address_, "libcurl cannot be used");
    const DoorClock::time_point begun = DoorClock::now();
    if (begun >= reached_by_) return Late(begun);
    Set(CURLOPT_TIMEOUT_MS, MillisecondsFrom(begun, until_));
    Set(CURLOPT_CONNECTTIMEOUT_MS, MillisecondsFrom(begun, reached_by_));
    if (set_ != CURLE_OK) return DoorFault(absl::StatusCode::kInternal, address_, curl_easy_strerror(set_));
    const CURLcode code = curl_easy_perform(curl_.get());
    if (code == CURLE_OK) return absl::OkStatus();
    if (received_.too_long) {
      return DoorFault(absl::StatusCode::kInternal, address_,
                       absl::StrCat("the answer has more than ", kMaxDoorAnswerBytes, " bytes"));
    }
    if (code == CURLE_OPERATION_TIMEDOUT) return Late(DoorClock::now());
    if (code == CURLE_PEER_FAILED_VERIFICATION) return NotTheCluster(address_);
    return DoorFault(absl::StatusCode::kUnavailable, address_, said_[0] != 0 ? said_.data() : curl_easy_strerror(code));
  }

  // Whether any of the request may have gone out.
  bool Sent() const {
    long bytes = 0;
    return curl_ && (curl_easy_getinfo(curl_.get(), CURLINFO_REQUEST_SIZE, &bytes) != CURLE_OK || bytes > 0);
  }

 private:
  static long MillisecondsFrom(DoorClock::time_point now, DoorClock::time_point to) {
    return static_cast<long>(std::chrono::ceil<std::chrono::milliseconds>(to - now).count());
  }
  absl::Status Late(DoorClock::time_point now) const {
    if (reached_by_ < until_ && now < until_ && !Sent()) {
      return DoorFault(absl::StatusCode::kUnavailable, address_, "is not reached in its share of the time");
    }
    return DoorFault(absl::StatusCode::kDeadlineExceeded, address_, "no answer");
  }

  const DoorAddress& address_;
  const DoorClock::time_point until_, reached_by_;
  std::array<char, CURL_ERROR_SIZE> said_{};
  Received received_;
  CURLcode set_ = CURLE_OK;
  CurlHandle curl_;  // ends before what it writes to
};

// Goes to the address, and expects the name of the cluster's own certificates. The list lives as long as the transfer.
ListHandle PointAt(const DoorAddress& address, const std::string& path, Transfer& transfer) {
  if (address.is_socket()) {
    transfer.Set(CURLOPT_URL, absl::StrCat("http://localhost", path).c_str());
    return nullptr;
  }
  const std::string where = absl::StrCat(InBrackets(address.host), ":", address.port);
  if (address.fingerprint.empty()) {
    transfer.Set(CURLOPT_URL, absl::StrCat("https://", where, path).c_str());
    return nullptr;
  }
  transfer.Set(CURLOPT_URL, absl::StrCat("https://", kDoorName, ":", address.port, path).c_str());
  ListHandle to(curl_slist_append(nullptr, absl::StrCat("::", where).c_str()));
  transfer.Set(CURLOPT_CONNECT_TO, to.get());
  return to;
}

// Whether the certificate, in PEM, is the one with this fingerprint.
bool HasFingerprint(absl::string_view pem, const std::string& fingerprint) {
  constexpr absl::string_view kBegin = "-----BEGIN CERTIFICATE-----", kEnd = "-----END CERTIFICATE-----";
  const std::size_t begin = pem.find(kBegin), end = pem.find(kEnd);
  if (begin == absl::string_view::npos || end == absl::string_view::npos || pem.size() > kMostCertificateBytes) {
    return false;
  }
  const std::size_t from = begin + kBegin.size();
  if (end < from) return false;
  std::vector<unsigned char> der(end - from);
  std::size_t size = 0;
  if (sodium_base642bin(der.data(), der.size(), pem.data() + from, end - from, "\r\n", &size, nullptr,
                        sodium_base64_VARIANT_ORIGINAL) != 0) {
    return false;
  }
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), der.data(), size);
  std::array<char, 2 * crypto_hash_sha256_BYTES + 1> text{};
  sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
  return fingerprint == text.data();
}

// The certificate of the authority, in PEM, from the server itself, which sends it with its own. It is trusted by its
// fingerprint; that it stands behind the server is for the transfer that follows.
absl::StatusOr<std::string> FetchDoorAuthority(const DoorAddress& address, DoorClock::time_point until,
                                               DoorClock::time_point reached_by) {
  Transfer transfer(address, until, reached_by);
  const ListHandle to = PointAt(address, "/", transfer);
  transfer.Set(CURLOPT_CONNECT_ONLY, 1L);
  transfer.Set(CURLOPT_CERTINFO, 1L);
  transfer.Set(CURLOPT_SSL_VERIFYPEER, 0L);
  transfer.Set(CURLOPT_SSL_VERIFYHOST, 0L);
  if (absl::Status status = transfer.Perform(); !status.ok()) return status;
  curl_certinfo* chain = nullptr;
  if (curl_easy_getinfo(transfer.get(), CURLINFO_CERTINFO, &chain) != CURLE_OK || chain == nullptr) {
    return NotTheCluster(address);
  }
  constexpr absl::string_view kField = "Cert:";
  for (int i = 0; i < chain->num_of_certs && i < static_cast<int>(kMostCertificates); ++i) {
    for (const curl_slist* field = chain->certinfo[i]; field != nullptr; field = field->next) {
      const absl::string_view text = field->data;
      if (text.substr(0, kField.size()) != kField) continue;
      const absl::string_view pem = text.substr(kField.size());
      if (HasFingerprint(pem, address.fingerprint)) return std::string(pem) + "\n";
    }
  }
  return NotTheCluster(address);
}

}  // namespace

std::string AtDoor(const DoorAddress& address) { return absl::StrCat("control plane at ", address.text, ": "); }

absl::StatusOr<DoorAnswer> AskDoor(const DoorAddress& address, const std::string& path, const std::string& body,
                                   DoorClock::time_point until, DoorReach* reach) {
  const DoorClock::time_point reached_by = reach == nullptr ? until : reach->reached_by;
  std::string authority;
  if (!address.fingerprint.empty()) {
    auto fetched = FetchDoorAuthority(address, until, reached_by);
    if (!fetched.ok()) return fetched.status();
    authority = *std::move(fetched);
  }
  Transfer transfer(address, until, reached_by);
  const ListHandle to = PointAt(address, path, transfer);
  ListHandle headers(curl_slist_append(nullptr, "Content-Type: application/json"));
  transfer.Set(CURLOPT_HTTPHEADER, headers.get());
  transfer.Set(CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size()));
  transfer.Set(CURLOPT_POSTFIELDS, body.c_str());
  transfer.Set(CURLOPT_SSL_VERIFYPEER, 1L);
  transfer.Set(CURLOPT_SSL_VERIFYHOST, 2L);
  // For Windows' TLS, which else asks every authority for a list; a cluster's own has none to be asked for.
  transfer.Set(CURLOPT_SSL_OPTIONS, long{authority.empty() ? CURLSSLOPT_REVOKE_BEST_EFFORT : CURLSSLOPT_NO_REVOKE});
  curl_blob root{authority.data(), authority.size(), CURL_BLOB_NOCOPY};
  if (!authority.empty()) {
    transfer.Set(CURLOPT_CAINFO_BLOB, &root);
    transfer.SetWherePossible(CURLOPT_CAPATH, static_cast<const char*>(nullptr));  // and no other authority
  }
  const absl::Status status = transfer.Perform();
  if (reach != nullptr) reach->sent = transfer.Sent();
  if (!status.ok()) return status;
  DoorAnswer answer;
  curl_easy_getinfo(transfer.get(), CURLINFO_RESPONSE_CODE, &answer.status);
  answer.body = std::move(transfer.received().body);
  return answer;
}

}  // namespace tessera::client
