// Files from a gateway that is played, one connection after the other.
#include "downloads.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

namespace desktop {
namespace {

// Gives each connection the next of these answers.
class PlayedGateway {
 public:
  explicit PlayedGateway(std::vector<std::string> answers) : answers_(std::move(answers)) {
    socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&at), size), 0);
    EXPECT_EQ(listen(socket_, 8), 0);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size), 0);
    page = "http://127.0.0.1:" + std::to_string(ntohs(at.sin_port)) + "/#key=feed";
    thread_ = std::thread([this] { Serve(); });
  }
  ~PlayedGateway() {
    shutdown(socket_, SHUT_RDWR);
    thread_.join();
    close(socket_);
  }
  PlayedGateway(const PlayedGateway&) = delete;
  PlayedGateway& operator=(const PlayedGateway&) = delete;

  static std::string Answer(const std::string& status, const std::string& body) {
    return "HTTP/1.1 " + status + "\r\nConnection: close\r\nContent-Length: " + std::to_string(body.size()) +
           "\r\n\r\n" + body;
  }

  std::string page;
  std::vector<std::string> asked;  // first lines; look at them once all has come

 private:
  void Serve() {
    for (const std::string& answer : answers_) {
      const int one = accept(socket_, nullptr, nullptr);
      if (one < 0) return;
      std::string request;
      char byte = 0;
      while (request.find("\r\n\r\n") == std::string::npos && recv(one, &byte, 1, 0) == 1) request += byte;
      asked.push_back(request.substr(0, request.find("\r\n")));
      (void)send(one, answer.data(), answer.size(), MSG_NOSIGNAL);
      close(one);
    }
  }

  const std::vector<std::string> answers_;
  int socket_ = -1;
  std::thread thread_;
};

Download Await(Downloads& downloads) {
  while (true) {
    std::vector<Download> ended = downloads.Take();
    if (!ended.empty()) return ended.front();
    std::this_thread::yield();
  }
}

TEST(DownloadsTest, AFileComesWithoutTheKeyOfThePage) {
  PlayedGateway gateway({PlayedGateway::Answer("200 OK", "glTF")});
  Downloads downloads(gateway.page, 100);
  ASSERT_TRUE(downloads.any());
  downloads.Begin("/visuals/a.glb");
  EXPECT_TRUE(downloads.under_way());
  const Download file = Await(downloads);
  EXPECT_EQ(file.problem, "");
  EXPECT_EQ(file.bytes, "glTF");
  EXPECT_EQ(file.path, "/visuals/a.glb");
  EXPECT_FALSE(downloads.under_way());
  EXPECT_EQ(gateway.asked, std::vector<std::string>{"GET /visuals/a.glb HTTP/1.1"});
}

TEST(DownloadsTest, WhatDoesNotComeIsSaidInTheGatewaysWords) {
  PlayedGateway gateway({PlayedGateway::Answer("404 Not Found", "the control plane has none\n"),
                         PlayedGateway::Answer("200 OK", std::string(101, 'x')),
                         "HTTP/1.1 200 OK\r\nContent-Length: 50\r\n\r\nhalf"});
  Downloads downloads(gateway.page, 100);
  downloads.Begin("/visuals/a.glb");
  EXPECT_EQ(Await(downloads).problem, "does not come: the control plane has none");
  downloads.Begin("/visuals/a.glb");
  EXPECT_EQ(Await(downloads).problem, "is larger than it may be");
  downloads.Begin("/visuals/a.glb");
  EXPECT_EQ(Await(downloads).problem.find("does not come: "), 0u) << "it was cut";
}

TEST(DownloadsTest, AGatewayThatCannotHaveItNowIsAskedAgain) {
  PlayedGateway gateway({PlayedGateway::Answer("503 Service Unavailable", "not now"),
                         PlayedGateway::Answer("503 Service Unavailable", "not now"),
                         PlayedGateway::Answer("200 OK", "glTF")});
  Downloads downloads(gateway.page, 100, std::chrono::milliseconds(1));
  downloads.Begin("/visuals/a.glb");
  const Download file = Await(downloads);
  EXPECT_EQ(file.bytes, "glTF");
  EXPECT_EQ(gateway.asked.size(), 3u);
}

TEST(DownloadsTest, WithoutAPageThereAreNoneAndWhereNobodyListensItIsSaid) {
  EXPECT_FALSE(Downloads("", 100).any());
  Downloads nobody("127.0.0.1:1", 100);
  nobody.Begin("/visuals/a.glb");
  EXPECT_EQ(Await(nobody).problem.find("does not come: "), 0u);
}

TEST(DownloadsTest, TheEndOfTheProgramIsNotKeptWaiting) {
  PlayedGateway gateway({PlayedGateway::Answer("503 Service Unavailable", "not now")});
  Downloads downloads(gateway.page, 100, std::chrono::hours(1));
  downloads.Begin("/visuals/a.glb");
}

}  // namespace
}  // namespace desktop
