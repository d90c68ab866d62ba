#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_core/base/quantile.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_recordings/drive_check.h"

namespace vcharge::internal {

/// Collects the findings of checks.
class CheckFindings {
 public:
  void add(const std::string& subject, CheckGrade grade, std::string what) {
    findings_.push_back({subject, grade, std::move(what)});
  }
  /// Grades a value that should be small: a warning above `warn`, a failure above `fail`.
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

constexpr double kDegree = 3.14159265358979323846 / 180.0;

inline std::string percentText(double fraction) {
  return toText(100.0 * fraction, fraction < 0.01 ? 2 : 1) + " %";
}

inline double fractionOf(int64_t part, int64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace vcharge::internal
