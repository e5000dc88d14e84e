#include "gateway/testing/viewer_decoder.h"

#include <stdexcept>

#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

using Words = nlohmann::ordered_json;

void Require(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

std::string Text(ByteReader& in) {
  const auto bytes = in.Block(in.remaining());
  return {bytes.begin(), bytes.end()};
}

std::int64_t Signed(ByteReader& in) {
  const std::uint64_t v = in.Varint();
  return static_cast<std::int64_t>(v >> 1) ^ -static_cast<std::int64_t>(v & 1);
}

Words Floats(ByteReader& in, std::size_t count) {
  Words list = Words::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(in.F32());
  return list;
}
Words Doubles(ByteReader& in, std::size_t count) {
  Words list = Words::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(in.F64());
  return list;
}

void Surface(ByteReader& in, Words& shape) {
  Words vertices = Words::array(), triangles = Words::array();
  const std::size_t vertex_count = in.Count(12);
  for (std::size_t i = 0; i < vertex_count; ++i) vertices.push_back(Floats(in, 3));
  const std::size_t triangle_count = in.Count(12);
  for (std::size_t i = 0; i < triangle_count; ++i) {
    Words corners = Words::array();
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = in.U32();
      Require(vertex < vertex_count, "triangle: no such vertex");
      corners.push_back(vertex);
    }
    triangles.push_back(corners);
  }
  shape["vertices"] = vertices;
  shape["triangles"] = triangles;
}

void Form(ByteReader& in, Words& shape, std::uint32_t number) {
  switch (shape["kind"].get<int>()) {
    case 0:
      shape["half_extents"] = Floats(in, 3);
      return;
    case 1:
      shape["radius"] = in.F32();
      return;
    case 2:
    case 3:
      shape["radius"] = in.F32();
      shape["half_height"] = in.F32();
      return;
    case 4:
      shape["radius"] = in.F32();
      shape["height"] = in.F32();
      return;
    case 5:
    case 7:
      return Surface(in, shape);
    case 6: {
      Words children = Words::array();
      for (std::size_t left = in.Count(29); left > 0; --left) {
        const std::uint64_t child = in.Varint();
        Require(child > 0 && child < number, "child: comes not before its parent");
        Words words{{"shape", child}};
        words["position"] = Floats(in, 3);
        words["orientation"] = Floats(in, 4);
        children.push_back(words);
      }
      shape["children"] = children;
      return;
    }
    case 8: {
      const std::uint64_t columns = in.Varint(), rows = in.Varint();
      Require(columns > 0 && rows <= in.remaining() / columns, "height field: too large");
      shape["columns"] = columns;
      shape["rows"] = rows;
      shape["spacing"] = in.F32();
      const std::uint8_t rim = in.U8();
      shape["rim"] = rim;
      shape["heights"] = Floats(in, (columns + (rim & 1) + (rim >> 1 & 1)) * (rows + (rim >> 2 & 1) + (rim >> 3 & 1)));
      return;
    }
    case 9:
      shape["normal"] = Floats(in, 3);
      shape["offset"] = in.F32();
      return;
    default:
      Require(false, "shape: unknown kind");
  }
}

}  // namespace

Vec3d ViewerDecoder::Body::Metres() const {
  return Vec3d{static_cast<double>(position[0]), static_cast<double>(position[1]), static_cast<double>(position[2])} /
         kPositionSteps_per_m;
}

Words ViewerDecoder::Take(std::span<const std::uint8_t> message) {
  ByteReader in(message);
  Words words;
  switch (static_cast<MessageKind>(in.U8())) {
    case MessageKind::kWelcome:
      words = Welcome(in);
      break;
    case MessageKind::kShapes:
      words = Shapes(in);
      break;
    case MessageKind::kVisuals:
      words = Visuals(in);
      break;
    case MessageKind::kStatics:
      words = Statics(in);
      break;
    case MessageKind::kTiles:
      words = Tiles(in);
      break;
    case MessageKind::kMap:
      words = Map(in);
      break;
    case MessageKind::kFrame:
      words = Frame(in);
      break;
    default:
      Require(false, "kind: unknown");
  }
  Require(in.ok(), "message: truncated");
  Require(in.remaining() == 0, "message: goes on after its end");
  return words;
}

Words ViewerDecoder::Welcome(ByteReader& in) {
  Words words{{"message", "welcome"}};
  Require(in.U8() == kViewerProtocolVersion, "version: not 2");
  words["instance"] = instance = Text(in);
  words["scene"] = Text(in);
  words["tick_rate_hz"] = in.Varint();
  words["bounds"] = Doubles(in, 6);
  words["gravity"] = Doubles(in, 3);
  words["own_body"] = own_body = in.Varint();
  words["own_player"] = own_player = in.Varint();
  Words properties = Words::array();
  for (std::size_t left = in.Count(2); left > 0; --left) {
    Words property{{"name", Text(in)}};
    property["type"] = in.U8();
    properties.push_back(property);
  }
  words["properties"] = properties;
  ++welcomes;
  bodies.clear();
  shapes = 0;
  statics = 0;
  return words;
}

Words ViewerDecoder::Shapes(ByteReader& in) {
  Words list = Words::array();
  for (std::size_t left = in.Count(2); left > 0; --left) {
    const std::uint32_t number = in.Varint32();
    Require(number == shapes + 1, "shape: numbers have a gap");
    shapes = number;
    Words shape{{"shape", number}};
    shape["kind"] = in.U8();
    Form(in, shape, number);
    list.push_back(shape);
  }
  return {{"message", "shapes"}, {"shapes", list}};
}

Words ViewerDecoder::Visuals(ByteReader& in) {
  Words list = Words::array();
  for (std::size_t left = in.Count(2); left > 0; --left) {
    const std::uint64_t shape = in.Varint();
    Require(shape > 0 && shape <= shapes, "visuals: no such shape");
    Words meshes = Words::array();
    for (std::size_t parts = in.Count(105); parts > 0; --parts) {
      Words words;
      words["sha256"] = Text(in);
      words["mesh"] = in.Varint();
      words["position"] = Floats(in, 3);
      words["orientation"] = Floats(in, 4);
      words["scale"] = Floats(in, 3);
      meshes.push_back(words);
    }
    list.push_back({{"shape", shape}, {"meshes", meshes}});
  }
  return {{"message", "visuals"}, {"visuals", list}};
}

Words ViewerDecoder::Statics(ByteReader& in) {
  Words list = Words::array();
  for (std::size_t left = in.Count(44); left > 0; --left) {
    Words words{{"body", in.Varint()}};
    words["name"] = Text(in);
    const std::uint32_t shape = in.Varint32();
    Require(shape > 0 && shape <= shapes, "shape: was not sent before");
    words["shape"] = shape;
    words["flags"] = in.U8();
    words["position"] = Doubles(in, 3);
    words["orientation"] = Floats(in, 4);
    list.push_back(words);
    ++statics;
  }
  return {{"message", "statics"}, {"statics", list}};
}

Words ViewerDecoder::Tiles(ByteReader& in) {
  Words list = Words::array();
  for (std::size_t left = in.Count(90); left > 0; --left) {
    Words words{{"bounds", Floats(in, 6)}};
    const std::uint64_t bytes = in.Varint();
    words["bytes"] = bytes;
    const std::string sha256 = Text(in);
    words["sha256"] = sha256;
    tiles.emplace_back(sha256, bytes);
    list.push_back(words);
  }
  return {{"message", "tiles"}, {"tiles", list}};
}

Words ViewerDecoder::Map(ByteReader& in) {
  Words words{{"message", "map"}, {"version", map_version = in.Varint()}};
  Words regions = Words::array(), cells = Words::array();
  hosts.clear();
  for (std::size_t left = in.Count(3); left > 0; --left) {
    Words region{{"region", in.Varint()}};
    region["standby"] = in.Varint();
    hosts.push_back(Text(in));
    region["host"] = hosts.back();
    regions.push_back(region);
  }
  for (std::size_t left = in.Count(33); left > 0; --left) {
    Words cell{{"owner", in.Varint()}};
    cell["area"] = Doubles(in, 4);
    cells.push_back(cell);
  }
  words["regions"] = regions;
  words["cells"] = cells;
  return words;
}

Words ViewerDecoder::Frame(ByteReader& in) {
  ++frames;
  Words words{{"message", "frame"}, {"tick", tick = in.Varint()}};
  words["time"] = time_s = in.F64();
  const std::uint8_t flags = in.U8();
  words["flags"] = flags;
  paused = (flags & kPausedFlag) != 0;
  Words vanished = Words::array(), appeared = Words::array(), changed = Words::array();
  std::uint64_t id = 0;
  for (std::size_t left = in.Count(1); left > 0; --left) {
    id += in.Varint();
    Require(bodies.erase(id) == 1, "vanished: was not there");
    vanished.push_back(id);
  }
  for (std::size_t left = in.Count(9); left > 0; --left) {
    const std::uint64_t body_id = in.Varint();
    Body body;
    body.shape = in.Varint32();
    Require(body.shape > 0 && body.shape <= shapes, "shape: was not sent before");
    body.flags = in.U8();
    body.player = in.Varint32();
    body.name = Text(in);
    body.mass_kg = in.F32();
    Require(bodies.emplace(body_id, body).second, "appeared: was there");
    appeared.push_back({{"body", body_id},
                        {"shape", body.shape},
                        {"flags", body.flags},
                        {"player", body.player},
                        {"name", body.name},
                        {"mass_kg", body.mass_kg}});
  }
  id = 0;
  for (std::size_t left = in.Count(2); left > 0; --left) {
    id += in.Varint();
    const auto found = bodies.find(id);
    Require(found != bodies.end(), "changed: is not there");
    Body& body = found->second;
    const std::uint8_t mask = in.U8();
    Words change{{"body", id}};
    if ((mask & kPositionBit) != 0) {
      for (std::int64_t& part : body.position) part += Signed(in);
      change["position"] = body.position;
    }
    if ((mask & kOrientationBit) != 0) change["orientation"] = body.orientation = in.U32();
    if ((mask & kOwnerBit) != 0) change["owner"] = body.owner = in.Varint32();
    if ((mask & kStateBit) != 0) change["state"] = body.state = in.U8();
    if ((mask & kSpeedBit) != 0) change["speed"] = body.speed = in.Varint32();
    changed.push_back(change);
  }
  words["vanished"] = vanished;
  words["appeared"] = appeared;
  words["changed"] = changed;
  return words;
}

}  // namespace tessera::gateway
