#pragma once

#include <chrono>
#include <map>
#include <string>
#include <utility>

namespace vcharge {

/// Measures the wall time until its destruction and adds it to the entry `name` of a map.
class StageTimer {
 public:
  StageTimer(std::string name, std::map<std::string, double>* times)
      : name_(std::move(name)), times_(times) {}
  ~StageTimer() {
    (*times_)[name_] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  const std::string name_;
  std::map<std::string, double>* times_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace vcharge
