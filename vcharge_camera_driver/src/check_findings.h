#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_camera_driver/drive_check.h"
#include "vcharge_core/text_format.h"

namespace vcharge::internal {

/// Collects what checks find.
class CheckFindings {
 public:
  void add(const std::string& subject, CheckGrade grade, std::string what) {
    findings_.push_back({subject, grade, std::move(what)});
  }
  /// A number that should be small.
  void atMost(const std::string& subject, double value, double warn, double fail, const std::string& figure,
              const std::string& advice) {
    const CheckGrade grade = value > fail   ? CheckGrade::kFail
                             : value > warn ? CheckGrade::kWarn
                                            : CheckGrade::kPass;
    add(subject, grade, grade == CheckGrade::kPass ? figure : figure + ": " + advice);
  }
  std::vector<CheckFinding> take() { return std::move(findings_); }

 private:
  std::vector<CheckFinding> findings_;
};

inline std::string percentText(double share) {
  return toText(100.0 * share, share < 0.01 ? 2 : 1) + " %";
}

/// The entry at the given share of the sorted values; `values` must not be empty.
inline double quantile(std::vector<double> values, double share) {
  const auto index = static_cast<size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(index);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vcharge::internal
