// WeakCache: values made from objects that others own, each kept for as long as its object lives.
//
//   WeakCache<const Shape, MassProperties> cache;
//   const MassProperties& mass = cache.Of(shape, [&] { return MassPropertiesOf(*shape); });
//
// Values of objects that are gone are dropped from time to time, when the cache has doubled.
// Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <unordered_map>

namespace tessera::physics {

template <class Key, class Value>
class WeakCache {
 public:
  // The value of `key`, made by `make()` at the first call. The reference holds while `key` lives.
  template <class Make>
  Value& Of(const std::shared_ptr<Key>& key, Make make) {
    if (entries_.size() >= drop_at_) DropExpired();
    Entry& entry = entries_[key.get()];
    // An object that is gone may have left its address to another one.
    if (entry.key.lock() != key) entry = {key, make()};
    return entry.value;
  }
  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::weak_ptr<Key> key;
    Value value{};
  };

  void DropExpired() {
    std::erase_if(entries_, [](const auto& entry) { return entry.second.key.expired(); });
    drop_at_ = std::max(kFewest, 2 * entries_.size());
  }

  static constexpr std::size_t kFewest = 64;
  std::unordered_map<Key*, Entry> entries_;
  std::size_t drop_at_ = kFewest;
};

}  // namespace tessera::physics
