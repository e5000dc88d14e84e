#include "downloads.h"

#include <curl/curl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace desktop {
namespace {

constexpr long kConnect_s = 10, kWhole_s = 90;
constexpr long kOk = 200, kNotNow = 503;
constexpr int kTries = 5;
constexpr std::chrono::milliseconds kLookUp{50};  // how soon the end of the program is noticed
constexpr std::size_t kMostWords = 200;           // characters of an error that are shown

struct Receiver {
  std::string bytes;
  std::size_t max_bytes = 0;
  const std::atomic<bool>* ending = nullptr;
};

std::size_t Receive(const char* data, std::size_t size, std::size_t count, void* user) {
  auto& receiver = *static_cast<Receiver*>(user);
  if (receiver.bytes.size() + size * count > receiver.max_bytes) return 0;  // which ends it
  receiver.bytes.append(data, size * count);
  return size * count;
}

int Look(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<Receiver*>(user)->ending->load() ? 1 : 0;
}

std::string AddressOf(const std::string& page) {
  std::string address = page.substr(0, page.find('#'));
  while (!address.empty() && address.back() == '/') address.pop_back();
  if (!address.empty() && address.find("://") == std::string::npos) address = "http://" + address;
  return address;
}

// The status, 0 if none came.
long Ask(const std::string& url, Receiver& receiver, std::string& problem) {
  const std::unique_ptr<CURL, void (*)(CURL*)> curl(curl_easy_init(), curl_easy_cleanup);
  std::array<char, CURL_ERROR_SIZE> words{};
  curl_easy_setopt(curl.get(), CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl.get(), CURLOPT_CONNECTTIMEOUT, kConnect_s);
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT, kWhole_s);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, Receive);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &receiver);
  curl_easy_setopt(curl.get(), CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(curl.get(), CURLOPT_XFERINFOFUNCTION, Look);
  curl_easy_setopt(curl.get(), CURLOPT_XFERINFODATA, &receiver);
  curl_easy_setopt(curl.get(), CURLOPT_ERRORBUFFER, words.data());
  const CURLcode code = curl_easy_perform(curl.get());
  long status = 0;
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &status);
  if (code == CURLE_OK) return status;
  problem = code == CURLE_WRITE_ERROR
                ? "is larger than it may be"
                : std::string("does not come: ") + (words[0] == '\0' ? curl_easy_strerror(code) : words.data());
  return 0;
}

}  // namespace

Downloads::Downloads(const std::string& page, std::size_t max_bytes, std::chrono::milliseconds try_again)
    : address_(AddressOf(page)), max_bytes_(max_bytes), try_again_(try_again) {
  if (any()) curl_global_init(CURL_GLOBAL_DEFAULT);
}

Downloads::~Downloads() {
  ending_ = true;
  coming_.clear();  // which waits for them
}

void Downloads::Begin(const std::string& path) {
  coming_.push_back(std::async(std::launch::async, [this, path] { return Fetch(path); }));
}

Download Downloads::Fetch(const std::string& path) const {
  Download file{.path = path, .bytes = {}, .problem = {}};
  for (int tried = 1;; ++tried) {
    Receiver receiver{.bytes = {}, .max_bytes = max_bytes_, .ending = &ending_};
    const long status = Ask(address_ + path, receiver, file.problem);
    if (status == kOk) {
      file.bytes = std::move(receiver.bytes);
      file.problem.clear();
      return file;
    }
    if (status != 0) {
      file.problem = receiver.bytes.substr(0, std::min(receiver.bytes.find('\n'), kMostWords));
      if (file.problem.empty()) file.problem = "the answer is " + std::to_string(status);
      file.problem = "does not come: " + file.problem;
    }
    if (status != kNotNow || tried == kTries) return file;
    const auto again = std::chrono::steady_clock::now() + try_again_;
    while (std::chrono::steady_clock::now() < again && !ending_) std::this_thread::sleep_for(kLookUp);
    if (ending_) return file;
  }
}

std::vector<Download> Downloads::Take() {
  std::vector<Download> ended;
  for (std::future<Download>& one : coming_) {
    if (one.wait_for(std::chrono::seconds(0)) == std::future_status::ready) ended.push_back(one.get());
  }
  std::erase_if(coming_, [](const std::future<Download>& one) { return !one.valid(); });
  return ended;
}

}  // namespace desktop
