// tessera game watch | send
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <iostream>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "cli/checks.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/signals.h"
#include "core/world/proto_math.h"
#include "local_cluster/connection.h"

namespace tessera::cli {
namespace {

constexpr std::chrono::milliseconds kBetweenAttempts{500};

struct BackendOptions {
  std::string id, name, request_id;
  std::vector<std::string> values;
  std::uint64_t from = 0, body = 0;
  std::uint32_t player = 0;
  double timeout_s = 15;
  bool dry_run = false;
};

std::string ValueText(const v1::GameField& field) {
  switch (field.value_case()) {
    case v1::GameField::kFlag:
      return field.flag() ? "true" : "false";
    case v1::GameField::kNumber:
      return fmt::format("{}", field.number());
    case v1::GameField::kReal:
      return fmt::format("{}", field.real());
    case v1::GameField::kText:
      return field.text();
    case v1::GameField::kVector:
      return fmt::format("{},{},{}", field.vector().x(), field.vector().y(), field.vector().z());
    case v1::GameField::kBody:
      return fmt::format("body:{}", field.body());
    case v1::GameField::kBytes:
      return fmt::format("{} bytes", field.bytes().size());
    case v1::GameField::kPlayer:
      return fmt::format("player:{}", field.player());
    case v1::GameField::VALUE_NOT_SET:
      break;
  }
  return "";
}

std::string EventText(const v1::PublishedEvent& event) {
  const auto time = fmt::localtime(event.time().seconds());
  if (event.has_restored()) {
    return fmt::format("{} {:%H:%M:%S} restored from the checkpoint of tick {}: forget events after {}\n",
                       event.number(), time, event.restored().tick(), event.restored().valid_up_to());
  }
  std::string text = fmt::format("{} {:%H:%M:%S} tick {}", event.number(), time, event.tick());
  if (event.body() != 0) text += fmt::format(" body {}", event.body());
  text += ": " + event.name();
  for (const v1::GameField& field : event.values()) text += fmt::format(" {}={}", field.name(), ValueText(field));
  if (event.missed() != 0) text += fmt::format(" ({} events before it were left out)", event.missed());
  return text + "\n";
}

// Reads events in a thread of its own, so that a signal ends it at any time. A control plane that goes away is asked
// again, from the cursor on.
class EventReader {
 public:
  EventReader(const Globals& globals, local::Connection& connection, const BackendOptions& options)
      : globals_(globals), connection_(connection), after_(options.from), id_(options.id) {}

  void Run(StopSignal& stop) {
    std::thread reading;
    while (!stopping_) {
      over_ = false;
      reading = std::thread([this] { ReadOnce(); });
      while (!over_ && !stopping_) {
        if (stop.Wait(std::chrono::milliseconds(100))) Cancel();
      }
      reading.join();
      if (stopping_ || status_.ok()) return;
      if (status_.error_code() != grpc::StatusCode::UNAVAILABLE || !read_any_) connection_.Check(status_, "game watch");
      if (!away_.exchange(true)) {
        std::cerr << fmt::format("the control plane is away; goes on after event {}\n", after_);
      }
      if (stop.Wait(kBetweenAttempts)) return;
    }
  }

 private:
  void ReadOnce() {
    v1::WatchGameEventsRequest request;
    request.set_id(id_);
    request.set_after(after_);
    grpc::ClientContext context;
    {
      const std::lock_guard lock(mutex_);
      context_ = &context;
    }
    if (stopping_) context.TryCancel();
    const auto reader = connection_.instances().WatchGameEvents(&context, request);
    reader->WaitForInitialMetadata();
    v1::WatchGameEventsResponse response;
    while (reader->Read(&response)) {
      read_any_ = true;
      away_ = false;
      std::cout << (globals_.format == Format::kJson ? ToJson(response.event()) : EventText(response.event()))
                << std::flush;
      after_ = response.event().number();
    }
    status_ = reader->Finish();
    {
      const std::lock_guard lock(mutex_);
      context_ = nullptr;
    }
    over_ = true;
  }
  void Cancel() {
    stopping_ = true;
    const std::lock_guard lock(mutex_);
    if (context_ != nullptr) context_->TryCancel();
  }

  const Globals& globals_;
  local::Connection& connection_;
  std::uint64_t after_;
  std::string id_;
  std::mutex mutex_;
  grpc::ClientContext* context_ = nullptr;
  grpc::Status status_;
  std::atomic<bool> over_ = false, stopping_ = false, read_any_ = false, away_ = false;
};

void WatchEvents(const Globals& globals, const BackendOptions& options) {
  StopSignal stop;
  local::Connection connection = Connect(globals);
  EventReader(globals, connection, options).Run(stop);
}

// "goals=3": a whole number, a number, true or false, x,y,z, body:7, player:2; anything else, and what "text:" comes
// before, is a text.
v1::GameField ReadField(const std::string& argument) {
  const std::pair<std::string, std::string> parts = absl::StrSplit(argument, absl::MaxSplits('=', 1));
  if (parts.first.empty() || argument.find('=') == std::string::npos) {
    throw local::CommandError(fmt::format("VALUES: \"{}\" is not of the form key=value", argument));
  }
  v1::GameField field;
  field.set_name(parts.first);
  std::string_view value = parts.second;
  const auto after = [&](std::string_view prefix) {
    if (!value.starts_with(prefix)) return false;
    value.remove_prefix(prefix.size());
    return true;
  };
  const auto shown = [](std::string_view text) { return absl::string_view(text.data(), text.size()); };
  const std::vector<std::string> xyz = absl::StrSplit(parts.second, ',');
  std::int64_t number = 0;
  std::uint64_t id = 0;
  std::uint32_t player = 0;
  double real = 0;
  Vec3d vector;
  if (after("text:")) {
    field.set_text(std::string(value));
  } else if (after("body:")) {
    if (!absl::SimpleAtoi(shown(value), &id)) throw local::CommandError(argument + ": no id of a body");
    field.set_body(id);
  } else if (after("player:")) {
    if (!absl::SimpleAtoi(shown(value), &player)) throw local::CommandError(argument + ": no number of a player");
    field.set_player(player);
  } else if (value == "true" || value == "false") {
    field.set_flag(value == "true");
  } else if (absl::SimpleAtoi(shown(value), &number)) {
    field.set_number(number);
  } else if (absl::SimpleAtod(shown(value), &real)) {
    field.set_real(real);
  } else if (xyz.size() == 3 && absl::SimpleAtod(xyz[0], &vector.x) && absl::SimpleAtod(xyz[1], &vector.y) &&
             absl::SimpleAtod(xyz[2], &vector.z)) {
    *field.mutable_vector() = ToProto(vector);
  } else {
    field.set_text(std::string(value));
  }
  return field;
}

std::string NewRequestId() {
  std::random_device random;
  return fmt::format("cli-{:08x}{:08x}{:08x}", random(), random(), random());
}

void Send(const Globals& globals, const BackendOptions& options) {
  local::Connection connection = Connect(globals);
  v1::SendToGameRequest request;
  request.set_id(options.id);
  request.set_request_id(options.request_id.empty() ? NewRequestId() : options.request_id);
  request.set_name(options.name);
  if (options.body != 0) request.set_body(options.body);
  if (options.player != 0) request.set_player(options.player);
  for (const std::string& value : options.values) *request.add_values() = ReadField(value);
  request.set_validate_only(options.dry_run);
  connection.Call("game send", connection.instances(), &v1::InstanceService::Stub::SendToGame, request,
                  std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout_s * 1000)));
  PrintChange(globals, "instance", options.id, fmt::format("was sent {}", options.name), options.dry_run, request);
}

}  // namespace

void AddGameBackendCommands(CLI::App& game, Globals& globals) {
  auto options = std::make_shared<BackendOptions>();
  CLI::App* watch = game.add_subcommand("watch", "Show the events that the game of an instance publishes");
  watch->add_option("id", options->id, "Id of the instance, as 'instance list' shows it")->required();
  watch->add_option("--from", options->from, "Number of the last event that is known; left out: all that are kept");
  watch->callback([&globals, options] { WatchEvents(globals, *options); });

  CLI::App* send = game.add_subcommand("send", "Send the game of an instance a message, as its backend");
  send->add_option("id", options->id, "Id of the instance, as 'instance list' shows it")->required();
  send->add_option("name", options->name, "What on_message is told, 1 to 32 bytes")->required();
  send->add_option("values", options->values, "key=value each: 3, 0.5, true, 1,2,3, body:7, player:2, or a text");
  CLI::Option* body = send->add_option("--body", options->body, "To this body; left out: to the world");
  send->add_option("--player", options->player, "To this player's body")->excludes(body);
  send->add_option("--request-id", options->request_id, "Makes it safe to repeat: the same id is the same message");
  send->add_option("--timeout", options->timeout_s, "Seconds to wait at most")
      ->capture_default_str()
      ->check(CLI::PositiveNumber)
      ->check(Finite());
  send->add_flag("--dry-run", options->dry_run, "Only check whether it could be done");
  send->callback([&globals, options] { Send(globals, *options); });
}

}  // namespace tessera::cli
