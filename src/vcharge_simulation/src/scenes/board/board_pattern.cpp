#include "scenes/board/board_pattern.h"

#include <stdexcept>

#include <opencv2/aruco/dictionary.hpp>
#include <opencv2/imgproc.hpp>

namespace vcharge {

namespace {

constexpr int kWhite = 200;
constexpr int kBlack = 12;

BoardPattern makeChessboard() {
  constexpr int kColumns = 10;  // squares in a row
  constexpr int kRows = 7;
  constexpr double kSquare_m = 0.1;
  constexpr double kMargin_m = 0.04;
  constexpr int kTexelsPerSquare = 40;
  constexpr int kMargin = 16;  // texels
  BoardPattern pattern;
  pattern.texels_per_m = kTexelsPerSquare / kSquare_m;
  pattern.size_m = {kColumns * kSquare_m + 2.0 * kMargin_m, kRows * kSquare_m + 2.0 * kMargin_m};
  pattern.image.create(kRows * kTexelsPerSquare + 2 * kMargin, kColumns * kTexelsPerSquare + 2 * kMargin,
                       CV_8UC1);
  pattern.image.setTo(cv::Scalar(kWhite));
  for (int row = 0; row < kRows; ++row) {
    for (int column = row % 2; column < kColumns; column += 2) {
      pattern
          .image(cv::Rect(kMargin + column * kTexelsPerSquare, kMargin + row * kTexelsPerSquare,
                          kTexelsPerSquare, kTexelsPerSquare))
          .setTo(cv::Scalar(kBlack));
    }
  }
  const Eigen::Vector2d first = -0.5 * pattern.size_m + Eigen::Vector2d::Constant(kMargin_m + kSquare_m);
  pattern.sheet_from_pattern = RigidTransform(Eigen::Quaterniond::Identity(), {first.x(), first.y(), 0.0});
  for (int row = 0; row < kRows - 1; ++row) {
    for (int column = 0; column < kColumns - 1; ++column) {
      pattern.corners_in_pattern_m.emplace_back(kSquare_m * column, kSquare_m * row, 0.0);
    }
  }
  pattern.target_yaml =
      "target_type: checkerboard\ntargetCols: 9\ntargetRows: 6\nrowSpacingMeters: 0.1\ncolSpacingMeters: "
      "0.1\n";
  return pattern;
}

// Bits of a tag, 6 x 6, 255 where white, upright as in AprilTag's own images (OpenCV's are rotated by half a
// turn).
cv::Mat tagBits(int id) {
  static const cv::Ptr<cv::aruco::Dictionary> dictionary =
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(dictionary->bytesList.row(id), 6);
  cv::rotate(bits, bits, cv::ROTATE_180);
  return bits * 255;
}

BoardPattern makeAprilGrid() {
  constexpr int kTags = 6;   // per row and column
  constexpr int kBits = 10;  // across a tag, including a border of two bits on either side
  constexpr double kTag_m = 0.088;
  constexpr double kSpacing = 0.3;  // relative to the tag's width
  constexpr int kTexelsPerBit = 8;
  constexpr int kTag = kBits * kTexelsPerBit;
  constexpr int kGap = 24;  // texels, kSpacing * kTag
  constexpr int kMargin = 32;
  constexpr double kTexel_m = kTag_m / kTag;
  static_assert(kGap * 10 == kTag * 3, "the gap is 0.3 of a tag");
  constexpr int kSize = kTags * kTag + (kTags + 1) * kGap + 2 * kMargin;
  BoardPattern pattern;
  pattern.texels_per_m = 1.0 / kTexel_m;
  pattern.size_m = Eigen::Vector2d::Constant(kSize * kTexel_m);
  pattern.image.create(kSize, kSize, CV_8UC1);
  pattern.image.setTo(cv::Scalar(kWhite));
  constexpr int kPitch = kTag + kGap;
  for (int row = 0; row <= kTags; ++row) {
    for (int column = 0; column <= kTags; ++column) {
      pattern.image(cv::Rect(kMargin + column * kPitch, kMargin + row * kPitch, kGap, kGap))
          .setTo(cv::Scalar(kBlack));
    }
  }
  for (int id = 0; id < kTags * kTags; ++id) {
    const int column = id % kTags;
    const int row = id / kTags;  // counted from below
    const cv::Rect area(kMargin + kGap + column * kPitch, kMargin + kGap + (kTags - 1 - row) * kPitch, kTag,
                        kTag);
    cv::Mat tag = pattern.image(area);
    tag.setTo(cv::Scalar(kBlack));
    cv::Mat bits;
    cv::resize(tagBits(id), bits, cv::Size(6 * kTexelsPerBit, 6 * kTexelsPerBit), 0, 0, cv::INTER_NEAREST);
    tag(cv::Rect(2 * kTexelsPerBit, 2 * kTexelsPerBit, bits.cols, bits.rows)).setTo(cv::Scalar(kWhite), bits);
    const double x = column * (1.0 + kSpacing) * kTag_m;
    const double y = row * (1.0 + kSpacing) * kTag_m;
    for (const Eigen::Vector3d& corner :
         {Eigen::Vector3d(x, y, 0.0), Eigen::Vector3d(x + kTag_m, y, 0.0),
          Eigen::Vector3d(x + kTag_m, y + kTag_m, 0.0), Eigen::Vector3d(x, y + kTag_m, 0.0)}) {
      pattern.corners_in_pattern_m.push_back(corner);
    }
  }
  const double first_m = (kMargin + kGap) * kTexel_m - 0.5 * pattern.size_m.x();
  pattern.sheet_from_pattern =
      RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(3.14159265358979323846, Eigen::Vector3d::UnitX())),
                     {first_m, -first_m, 0.0});
  pattern.target_yaml = "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n";
  return pattern;
}

}  // namespace

std::vector<std::string> listBoards() {
  return {"chessboard", "aprilgrid"};
}

BoardPattern makeBoardPattern(const std::string& name) {
  if (name == "chessboard") {
    return makeChessboard();
  }
  if (name == "aprilgrid") {
    return makeAprilGrid();
  }
  throw std::invalid_argument("board: expected one of chessboard, aprilgrid, got '" + name + "'");
}

}  // namespace vcharge
