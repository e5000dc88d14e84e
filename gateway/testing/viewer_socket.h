// ViewerSocket: a WebSocket as a browser has one, by hand, so that tests and benchmarks can be slow, loud and wrong on
// purpose.
//
//   ViewerSocket viewer("127.0.0.1:7710", "inst-1");
//   viewer.Until([&] { return viewer.decoder.bodies.size() == 100; }, patience);
//
// Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/testing/viewer_decoder.h"

namespace tessera::gateway {

class ViewerSocket {
 public:
  struct Options {
    std::string path = {};    // else /watch/INSTANCE
    std::string origin = {};  // none
    std::string host = {};    // else the address
    int receive_buffer_bytes = 0;
    // Gets the binary messages in place of the decoder, whose words cost more than the gateway that is measured.
    std::function<void(std::span<const std::uint8_t>)> on_binary = {};
    // Gets each text message too, for those who must not miss one.
    std::function<void(const nlohmann::json&)> on_text = {};
  };
  ViewerSocket(const std::string& address, const std::string& instance) : ViewerSocket(address, instance, Options()) {}
  ViewerSocket(const std::string& address, const std::string& instance, const Options& options);
  ~ViewerSocket();
  ViewerSocket(const ViewerSocket&) = delete;
  ViewerSocket& operator=(const ViewerSocket&) = delete;

  void Send(const nlohmann::json& message) { SendFrame(kText, message.dump()); }
  void SendFrame(std::uint8_t opcode, std::string_view payload);
  void SendBytes(std::string_view bytes);

  // Takes what comes until it holds; false when time is up.
  bool Until(const std::function<bool()>& holds, std::chrono::milliseconds patience);
  // Takes what has come by now, and waits for it at most so long. Gives how many bytes came, at most `most`.
  std::size_t Take(std::chrono::milliseconds wait, std::size_t most = kTake_bytes);

  static constexpr std::size_t kTake_bytes = std::size_t{1} << 16;
  static constexpr std::uint8_t kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10;

  ViewerDecoder decoder;
  int http_status = 0;
  std::map<std::string, nlohmann::json> newest;  // texts by their type
  std::map<std::string, int> texts;              // how many came
  std::uint64_t bytes = 0;
  std::optional<std::string> closed;  // "4000 no_world"; empty: without a word

 private:
  void ReadAnswer();
  void ReadFrames();
  void OnFrame(std::uint8_t opcode, std::string_view payload);

  std::function<void(std::span<const std::uint8_t>)> on_binary_;
  std::function<void(const nlohmann::json&)> on_text_;
  int socket_ = -1;
  bool upgraded_ = false;
  std::string received_;
};

}  // namespace tessera::gateway
