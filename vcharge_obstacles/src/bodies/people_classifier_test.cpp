#include "bodies/people_classifier.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>

namespace vcharge {
namespace {

TEST(PeopleClassifierTest, ScoresAreThoseOfOpenCv) {
  cv::HOGDescriptor hog;
  hog.setSVMDetector(cv::HOGDescriptor::getDefaultPeopleDetector());
  const PeopleClassifier classifier;
  cv::RNG random(7);
  for (const cv::Size size : {cv::Size(64, 128), cv::Size(96, 144), cv::Size(112, 152)}) {
    cv::Mat image(size, CV_8UC1), roots;
    random.fill(image, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(image, image, cv::Size(), 2.0);
    cv::ellipse(image, cv::Point(size.width / 2, size.height / 2), cv::Size(12, 45), 0.0, 0.0, 360.0,
                cv::Scalar(230), cv::FILLED);
    image.convertTo(roots, CV_32F);
    cv::sqrt(roots, roots);
    std::vector<cv::Point> places;
    std::vector<double> expected;
    hog.detect(image, places, expected, -1e3, cv::Size(8, 8), cv::Size(0, 0));
    const cv::Mat scores = classifier.scores(roots);
    ASSERT_EQ(expected.size(), scores.total());
    for (size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR(scores.at<float>(places[i].y / 8, places[i].x / 8), expected[i], 2e-3) << places[i];
    }
  }
}

TEST(PeopleClassifierTest, AnImageSmallerThanAWindowIsAnError) {
  EXPECT_THROW(PeopleClassifier().scores(cv::Mat::zeros(127, 64, CV_32FC1)), std::logic_error);
}

}  // namespace
}  // namespace vcharge
