// HttpConnections: the HTTP side of the event loop: takes requests from libwebsockets to the site, and sends its
// answers, no more of one at once than its socket takes, so that a browser that reads slowly costs no memory.
//
// Thread rule: the event loop's. What calls return is what the callback of libwebsockets returns: other than 0 ends the
// connection.
#pragma once

#include <libwebsockets.h>

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "gateway/http_site.h"

namespace tessera::gateway {

class HttpConnections {
 public:
  explicit HttpConnections(HttpSite& site) : site_(site) {}

  // A request has come. What the connection waited for before is dropped.
  int Begin(lws* wsi);
  // Whether a request of this connection has not been answered whole.
  bool Has(lws* wsi) const { return connections_.contains(wsi); }
  // It takes bytes. Only for one that is there.
  int Write(lws* wsi);
  void Forget(lws* wsi) { connections_.erase(wsi); }

  std::size_t size() const { return connections_.size(); }

 private:
  struct Connection {
    std::shared_ptr<HttpExchange> exchange;
    bool begun = false;  // the head is sent
    std::size_t sent = 0;
  };
  int SendHead(lws* wsi, Connection& connection);
  int SendPiece(lws* wsi, Connection& connection);
  int Complete(lws* wsi);

  HttpSite& site_;
  std::map<lws*, Connection> connections_;
  std::vector<unsigned char> out_;
};

}  // namespace tessera::gateway
