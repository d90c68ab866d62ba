#pragma once

#include <cstdint>
#include <queue>
#include <tuple>
#include <vector>

#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// Sorts items that arrive roughly in order of stamps: an item is released when one that is newer by `window`
/// has arrived. At equal stamps the lower rank comes first, then the earlier arrival. Not thread safe.
template <class Item>
class StampSorter {
 public:
  explicit StampSorter(Duration window) : window_(window) {}

  /// Whether a stamp is late by more than the window, so that it cannot be sorted.
  bool isTooLate(Timestamp stamp) const { return any_ && stamp < newest_ - window_; }
  Timestamp newest() const { return newest_; }
  bool empty() const { return queue_.empty(); }

  void push(Timestamp stamp, int rank, Item item) {
    queue_.push(Entry{stamp, rank, sequence_++, std::move(item)});
    newest_ = any_ && stamp < newest_ ? newest_ : stamp;
    any_ = true;
  }

  /// Releases the items that are old enough, in order.
  template <class Function>
  void release(Function&& function) {
    while (!queue_.empty() && queue_.top().stamp <= newest_ - window_) {
      pop(function);
    }
  }

  /// Releases all items, in order.
  template <class Function>
  void flush(Function&& function) {
    while (!queue_.empty()) {
      pop(function);
    }
  }

  /// Drops all items and resets the newest stamp.
  void clear() {
    queue_ = {};
    any_ = false;
  }

 private:
  struct Entry {
    Timestamp stamp;
    int rank;
    uint64_t sequence;
    mutable Item item;                          // moved out of the const top just before pop()
    bool operator<(const Entry& other) const {  // the queue's top is its largest
      return std::tie(other.stamp, other.rank, other.sequence) < std::tie(stamp, rank, sequence);
    }
  };

  template <class Function>
  void pop(Function&& function) {
    const Timestamp stamp = queue_.top().stamp;
    Item item = std::move(queue_.top().item);
    queue_.pop();
    function(stamp, std::move(item));
  }

  const Duration window_;
  std::priority_queue<Entry> queue_;
  uint64_t sequence_ = 0;
  Timestamp newest_;
  bool any_ = false;
};

}  // namespace vcharge
