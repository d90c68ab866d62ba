#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <rosbag/bag.h>

#include "vcharge_core/error.h"

namespace vcharge::internal {

/// Runs a step of librosbag, whose errors come in many types, and names the bag in what it throws.
template <class Function>
auto readingBag(const std::string& path, Function&& function) -> decltype(function()) {
  try {
    return function();
  } catch (const InputError&) {
    throw;
  } catch (const rosbag::BagUnindexedException&) {
    throw InputError(path +
                     ": the bag has no index (was its recording cut off?); expected a complete bag, see "
                     "`rosbag reindex`");
  } catch (const std::exception& error) {
    throw InputError(path + ": corrupt or truncated; expected a ROS bag of format 2.0 (" + error.what() +
                     ")");
  }
}

/// InputError where there is no such file or it is no bag.
inline std::unique_ptr<rosbag::Bag> openBag(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw InputError(path + ": no such file; expected a ROS bag");
  }
  return readingBag(path, [&] { return std::make_unique<rosbag::Bag>(path, rosbag::bagmode::Read); });
}

}  // namespace vcharge::internal
