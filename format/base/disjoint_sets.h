// Numbers in sets that have none in common.
#pragma once

#include <numeric>
#include <vector>

namespace selvedge {

class DisjointSets {
 public:
  /// Starts with a set for each number below `count`.
  explicit DisjointSets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }

  /// Adds a number with a set of its own and returns it.
  int add() {
    parents_.push_back(static_cast<int>(parents_.size()));
    return parents_.back();
  }
  /// Returns a number that stands for the whole set.
  int root(int number) {
    while (parents_[number] != number) number = parents_[number] = parents_[parents_[number]];
    return number;
  }
  /// Joins the set of `from` to the set of `to`, whose root is kept.
  void unite(int from, int to) { parents_[root(from)] = root(to); }

 private:
  std::vector<int> parents_;
};

}  // namespace selvedge
