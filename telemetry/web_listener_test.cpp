#include "telemetry/web_listener.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>

#include "telemetry/http_get.h"

namespace tessera::telemetry {
namespace {

// Answers each request with 404 and its query, and counts how often it was woken.
class EchoPage {
 public:
  ~EchoPage() {
    stopping_ = true;
    listener_.Wake();
    if (loop_.joinable()) loop_.join();
  }
  bool Open(const WebListenerOptions& options) {
    if (!listener_.Open(options, {{"http", OnEvent, 0, 0, 0, nullptr, 0}}, this)) return false;
    loop_ = std::thread([this] { listener_.Serve(stopping_); });
    return true;
  }
  // Returns when the loop has seen it.
  bool Wake() {
    listener_.Wake();
    woken_.wait(false);
    return woken_;
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(listener_.port()); }

 private:
  static int OnEvent(lws* wsi, lws_callback_reasons reason, void*, void*, size_t) {
    auto& me = *static_cast<EchoPage*>(lws_context_user(lws_get_context(wsi)));
    switch (reason) {
      case LWS_CALLBACK_HTTP:
        me.query_ = RequestHeader(wsi, WSI_TOKEN_HTTP_URI_ARGS);
        lws_callback_on_writable(wsi);
        return 0;
      case LWS_CALLBACK_HTTP_WRITEABLE:
        return WriteLastAnswer(wsi, {.status = 404, .content_type = "text/plain", .body = me.query_});
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        me.woken_ = true;
        me.woken_.notify_all();
        return 0;
      default:
        return 0;
    }
  }

  std::string query_;  // only the loop's thread uses it
  std::atomic<bool> stopping_{false}, woken_{false};
  std::thread loop_;
  WebListener listener_;
};

TEST(WebListenerTest, AnswersRequestsOneAfterAnother) {
  EchoPage page;
  ASSERT_TRUE(page.Open({.listen = {"127.0.0.1", 0}, .timeout_s = 10}));
  for (const std::string& query : {std::string("a=1"), std::string(900, 'b'), std::string("c=3")}) {
    const auto answer = HttpGet(page.address(), "/any/path?" + query);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->status, 404);
    EXPECT_EQ(answer->body, query);
  }
}

TEST(WebListenerTest, AHeaderThatIsTooLongIsLeftOut) {
  EchoPage page;
  ASSERT_TRUE(page.Open({.listen = {"127.0.0.1", 0}, .timeout_s = 10}));
  const auto answer = HttpGet(page.address(), "/?" + std::string(1024, 'b'));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->body, "");
}

TEST(WebListenerTest, AnotherThreadWakesTheLoop) {
  EchoPage page;
  ASSERT_TRUE(page.Open({.listen = {"127.0.0.1", 0}}));
  EXPECT_TRUE(page.Wake());
}

}  // namespace
}  // namespace tessera::telemetry
