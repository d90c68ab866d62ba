#include "vcharge_recordings/bag_reader.h"

#include <algorithm>
#include <fstream>
#include <tuple>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/String.h>

#include "vcharge_core/files/file_io.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::expectInputError;
using testing::ScratchFolder;

constexpr size_t kVersionSize = 13;  // "#ROSBAG V2.0\n"

using Recorded = std::tuple<ros::Time, std::string, std::string>;  // time, topic, text

template <class Number>
std::string bytesOf(Number value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

template <class Number>
Number numberAt(const std::string& bytes, size_t at) {
  Number value;
  std::memcpy(&value, &bytes[at], sizeof(value));
  return value;
}

/// Position of the first byte of the n-th "name=" value.
size_t valueOf(const std::string& bytes, const std::string& name, int n = 0) {
  size_t at = bytes.find(name + "=");
  for (; n > 0; --n) {
    at = bytes.find(name + "=", at + 1);
  }
  EXPECT_NE(at, std::string::npos) << name;
  return at + name.size() + 1;
}

class BagReaderTest : public ::testing::Test {
 protected:
  const ScratchFolder folder_;
  const std::string path_ = folder_ / "a.bag";

  /// Writes two topics in several chunks; returns the file's bytes.
  std::string write(rosbag::CompressionType compression = rosbag::compression::Uncompressed,
                    int num_messages = 3, uint32_t chunk_threshold = 1) const {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    bag.setChunkThreshold(chunk_threshold);
    bag.setCompression(compression);
    for (int i = 0; i < num_messages; ++i) {
      std_msgs::String message;
      message.data = "message " + std::to_string(i) + std::string(50, 'x');
      bag.write(i % 2 == 0 ? "/even" : "/odd", ros::Time(10, i), message);
    }
    bag.close();
    return readTextFile(path_);
  }

  void save(const std::string& bytes) const {
    std::filesystem::remove(path_);  // overwriting a file is slow on some file systems
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  void put(std::string bytes, size_t at, const std::string& piece) const {
    save(bytes.replace(at, piece.size(), piece));
  }

  std::vector<Recorded> read() const {
    BagReader bag(path_);
    std::vector<Recorded> messages;
    for (const BagEntry& entry : bag.entries({"/even", "/odd"})) {
      messages.emplace_back(entry.time, bag.topicOf(entry),
                            bag.read(entry).instantiate<std_msgs::String>()->data);
    }
    return messages;
  }

  void expectError(const std::vector<std::string>& parts) const {
    std::vector<std::string> all = parts;
    all.push_back(path_);
    expectInputError([&] { read(); }, all);
  }
  /// Replaces some of the bytes before the bag is read.
  void expectErrorAfter(std::string bytes, size_t at, const std::string& piece,
                        const std::vector<std::string>& parts) const {
    put(std::move(bytes), at, piece);
    expectError(parts);
  }
};

const std::vector<rosbag::CompressionType> kCompressions = {
    rosbag::compression::Uncompressed, rosbag::compression::BZ2, rosbag::compression::LZ4};

TEST_F(BagReaderTest, ReadsWhatLibrosbagReads) {
  for (const auto compression : kCompressions) {
    for (const uint32_t chunk_threshold : {1U, 500U, 1000000U}) {
      write(compression, 40, chunk_threshold);
      std::vector<Recorded> expected;
      rosbag::Bag bag(path_);
      for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
        expected.emplace_back(message.getTime(), message.getTopic(),
                              message.instantiate<std_msgs::String>()->data);
      }
      EXPECT_EQ(read(), expected);
      ASSERT_EQ(expected.size(), 40U);
    }
  }
  const BagReader bag(path_);
  const std::set<std::string> type = {"std_msgs/String"};
  EXPECT_EQ(bag.topics(), (std::map<std::string, std::set<std::string>>{{"/even", type}, {"/odd", type}}));
  EXPECT_EQ(bag.entries({"/odd"}).size(), 20U);
  EXPECT_TRUE(bag.entries({"/neither"}).empty());
}

TEST_F(BagReaderTest, OrdersMessagesByTheTimeOfTheirRecording) {
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  bag.setChunkThreshold(1);
  for (const int nsec : {30, 10, 20}) {
    bag.write("/even", ros::Time(1, nsec), std_msgs::String());
  }
  bag.close();
  const std::vector<Recorded> messages = read();
  ASSERT_EQ(messages.size(), 3U);
  EXPECT_TRUE(std::is_sorted(messages.begin(), messages.end()));
}

// Covers compressed chunks, too, each of which is decompressed only once.
TEST_F(BagReaderTest, OrdersMessagesOfOneTimeAsTheyLieInTheBag) {
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  bag.setChunkThreshold(1);
  bag.setCompression(rosbag::compression::LZ4);
  std::vector<std::string> topics;
  for (int i = 0; i < 20; ++i) {
    topics.emplace_back(i % 3 == 0 ? "/odd" : "/even");
    bag.write(topics.back(), ros::Time(1), std_msgs::String());
  }
  bag.close();
  const BagReader reader(path_);
  std::vector<std::string> read;
  for (const BagEntry& entry : reader.entries({"/even", "/odd"})) {
    read.push_back(reader.topicOf(entry));
  }
  EXPECT_EQ(read, topics);
}

TEST_F(BagReaderTest, NamesOtherFormats) {
  const std::string whole = write();
  expectErrorAfter(whole, 9, "1.2", {"expected a ROS bag of format 2.0"});
  save("#ROS" + std::string(900, 'x') + " V2.0\n" + whole.substr(kVersionSize));
  expectError({"expected a ROS bag of format 2.0"});
}

TEST_F(BagReaderTest, NamesAnEncryptedBag) {
  std::string bytes = write();
  // One more field in the file's header, which replaces some of the padding behind it.
  const std::string field = "encryptor=rosbag/AesCbcEncryptor";
  const std::string added = bytesOf(static_cast<uint32_t>(field.size())) + field;
  const auto header_size = numberAt<uint32_t>(bytes, kVersionSize);
  const size_t padding = kVersionSize + 4 + header_size;
  const auto padding_size = numberAt<uint32_t>(bytes, padding);
  bytes.replace(padding, 4, bytesOf(static_cast<uint32_t>(padding_size - added.size())));
  bytes.erase(padding + 4, added.size());
  bytes.insert(padding, added);
  expectErrorAfter(bytes, kVersionSize, bytesOf(static_cast<uint32_t>(header_size + added.size())),
                   {"without encryption", "rosbag/AesCbcEncryptor", "rosbag decrypt"});
}

TEST_F(BagReaderTest, NamesAHeaderThatDoesNotEndInTheFile) {
  const std::string whole = write();
  for (const uint32_t length : {0xffffffffU, 0x7fffffffU, static_cast<uint32_t>(whole.size())}) {
    expectErrorAfter(whole, kVersionSize, bytesOf(length),
                     {"byte 13", "header of at most", std::to_string(length)});
  }
  // The file is large enough for this length, but no header is so long.
  expectErrorAfter(whole + std::string(20 << 20, ' '), kVersionSize, bytesOf(17U << 20),
                   {"byte 13", "header of at most 16777216", std::to_string(17 << 20)});
}

TEST_F(BagReaderTest, NamesAFieldThatDoesNotEndInItsHeader) {
  const std::string whole = write();
  const auto header_size = numberAt<uint32_t>(whole, kVersionSize);
  for (const uint32_t length : {header_size - 3, 1000000U, 0xfffffffcU}) {
    expectErrorAfter(
        whole, kVersionSize + 4, bytesOf(length),
        {"byte 21", "the " + std::to_string(header_size - 4) + " bytes that are left of its header",
         std::to_string(length)});
  }
  // The header ends inside the field's length.
  expectErrorAfter(whole, kVersionSize, bytesOf(uint32_t{2}),
                   {"byte 17", "field's length within its header"});
}

TEST_F(BagReaderTest, NamesFieldsThatAreNone) {
  const std::string whole = write();
  expectErrorAfter(whole, valueOf(whole, "op") - 1, "x", {"a field with '='"});
  expectErrorAfter(whole, valueOf(whole, "op") - 2, "q", {"byte 17", "field 'op'"});
  expectErrorAfter(whole, valueOf(whole, "op"), "\x05", {"byte 13", "file header (op 3)", "op 5"});
  // A message's record has conn, op and time. A second "conn" of 8 bytes replaces the first.
  expectErrorAfter(whole, valueOf(whole, "time") - 5, "conn", {"field 'conn' of 4 bytes, got 8"});
}

TEST_F(BagReaderTest, NamesAnIndexThatIsNotThere) {
  const std::string whole = write();
  const size_t at = valueOf(whole, "index_pos");
  expectErrorAfter(whole, at, bytesOf(uint64_t{0}), {"no index", "rosbag reindex"});
  for (const uint64_t position : {uint64_t{1}, uint64_t{4000}, uint64_t{whole.size() + 1}, ~uint64_t{0}}) {
    expectErrorAfter(whole, at, bytesOf(position), {"byte 13", "index's position", std::to_string(position)});
  }
  expectErrorAfter(whole, at, bytesOf(uint64_t{whole.size()}),
                   {"the length of the header of a record (connection)"});
  expectErrorAfter(whole, valueOf(whole, "conn_count"), bytesOf(~uint32_t{0}), {"record of kind connection"});
  expectErrorAfter(whole, valueOf(whole, "chunk_count"), bytesOf(~uint32_t{0}), {"record (chunk info)"});
}

TEST_F(BagReaderTest, NamesAConnectionWhoseDefinitionIsDamaged) {
  const std::string whole = write();
  const auto index = numberAt<uint64_t>(whole, valueOf(whole, "index_pos"));
  // A record: length of its header, header, length of its data, and the first field of the data.
  const size_t data = index + 8 + numberAt<uint32_t>(whole, index);
  expectErrorAfter(whole, data, bytesOf(uint32_t{900000}), {"left of its header", "900000"});
  expectErrorAfter(whole, data - 4, bytesOf(~uint32_t{0}), {"data of at most", "4294967295"});
  expectErrorAfter(whole, whole.find("md5sum=", index), "md6sum", {"field 'md5sum'"});
}

TEST_F(BagReaderTest, NamesAChunkThatIsNotThere) {
  const std::string whole = write();
  const size_t at = valueOf(whole, "chunk_pos");
  for (const uint64_t position : {uint64_t{whole.size()}, ~uint64_t{0}, ~uint64_t{3}}) {
    expectErrorAfter(whole, at, bytesOf(position), {"a chunk before the index", std::to_string(position)});
  }
  expectErrorAfter(whole, at, bytesOf(numberAt<uint64_t>(whole, at) + 1), {"expected"});
  expectErrorAfter(whole, at, bytesOf(uint64_t{kVersionSize}), {"byte 13", "chunk (op 5)", "op 3"});
}

TEST_F(BagReaderTest, NamesChunksThatAreDamaged) {
  const std::string whole = write();
  expectErrorAfter(whole, valueOf(whole, "compression"), "nonf", {"compression none, bz2 or lz4"});
  const size_t size = valueOf(whole, "size");
  expectErrorAfter(whole, size, bytesOf(uint32_t{7}), {"a chunk of the size of its data", "got 7"});
  // The length of its data follows its last field, the size.
  expectErrorAfter(whole, size + 4, bytesOf(~uint32_t{0}), {"data of at most", "4294967295"});
}

TEST_F(BagReaderTest, NamesCountsThatAreNotWhatFollows) {
  const std::string whole = write();
  // Counts, in order: index of the first chunk, ..., chunk infos. 12 and 8 bytes for each: these products
  // are the true ones modulo 2^32.
  const size_t index_count = valueOf(whole, "count", 2);  // after conn_count and chunk_count
  expectErrorAfter(whole, index_count, bytesOf(numberAt<uint32_t>(whole, index_count) + (1U << 30)),
                   {"an index of version 1 with 12 bytes for each"});
  const size_t info_count = whole.find("count=", whole.find("chunk_pos=")) + 6;
  expectErrorAfter(whole, info_count, bytesOf(numberAt<uint32_t>(whole, info_count) + (1U << 29)),
                   {"a chunk info of version 1 with 8 bytes for each"});
  expectErrorAfter(whole, valueOf(whole, "ver"), bytesOf(uint32_t{2}), {"an index of version 1"});
}

TEST_F(BagReaderTest, NamesIndicesThatAreDamaged) {
  const std::string whole = write();
  // An index's record ends with its field "ver", the length of its data, and time and offset of each message.
  const size_t entry = valueOf(whole, "ver") + 8;
  const auto offset = numberAt<uint32_t>(whole, entry + 8);
  const auto chunk_size = numberAt<uint32_t>(whole, valueOf(whole, "size"));
  for (const uint32_t beyond : {chunk_size, ~uint32_t{0}}) {
    expectErrorAfter(whole, entry + 8, bytesOf(beyond),
                     {"byte " + std::to_string(entry), "in a chunk of " + std::to_string(chunk_size)});
  }
  for (const uint32_t inside : {offset + 1, offset + 4, chunk_size - 1, chunk_size - 5, uint32_t{0}}) {
    SCOPED_TRACE(inside);
    expectErrorAfter(whole, entry + 8, bytesOf(inside), {"expected"});
  }
  expectErrorAfter(whole, entry + 4, bytesOf(uint32_t{1000000000}),
                   {"byte " + std::to_string(entry), "a time"});
  // Fields come in the order of their names: conn, count, op, ver.
  const size_t connection = whole.rfind("conn=", entry) + 5;
  expectErrorAfter(whole, connection, bytesOf(uint32_t{77}),
                   {"a connection of the index, got connection 77"});
  expectErrorAfter(whole, connection, bytesOf(uint32_t{1}), {"a message on /odd, as the index says"});
}

TEST_F(BagReaderTest, NamesAMessageThatDoesNotEndInItsChunk) {
  const std::string whole = write();
  const size_t length = valueOf(whole, "time") + 8;  // the last field of its header
  for (const uint32_t value : {numberAt<uint32_t>(whole, length) + 1, ~uint32_t{0}}) {
    expectErrorAfter(whole, length, bytesOf(value),
                     {"byte " + std::to_string(length), "data of at most", std::to_string(value)});
  }
}

TEST_F(BagReaderTest, NamesCompressedChunksThatAreDamaged) {
  for (const auto compression : {rosbag::compression::BZ2, rosbag::compression::LZ4}) {
    const std::string whole = write(compression, 1);
    const size_t size = valueOf(whole, "size");
    const auto true_size = numberAt<uint32_t>(whole, size);
    const size_t data = size + 8;
    const auto data_size = numberAt<uint32_t>(whole, size + 4);
    const std::vector<Recorded> recorded = read();
    int num_errors = 0;
    for (size_t at = data; at < data + data_size; ++at) {
      for (const char bit : {'\x01', '\x10', '\x80'}) {
        put(whole, at, std::string(1, static_cast<char>(whole[at] ^ bit)));
        try {
          EXPECT_EQ(read(), recorded);  // a few bits have no meaning
        } catch (const InputError& error) {
          ++num_errors;
          EXPECT_THAT(error.what(), ::testing::HasSubstr(path_));
        }
      }
    }
    EXPECT_GT(num_errors, static_cast<int>(data_size) * 3 - 40);
    for (const uint32_t other : {true_size - 1, true_size + 1, 0x7fffffffU, ~uint32_t{0}}) {
      expectErrorAfter(whole, size, bytesOf(other),
                       {"chunk with data at byte " + std::to_string(data), std::to_string(other) + " bytes"});
    }
  }
}

// A block longer than lz4's buffer, which librosbag would copy.
TEST_F(BagReaderTest, NamesALz4BlockThatIsTooLong) {
  const std::string whole = write(rosbag::compression::LZ4, 1);
  const size_t block_length = valueOf(whole, "size") + 8 + 7;  // after the stream's header of 7 bytes
  for (const uint32_t length : {0x7fffffffU, 0xffffffffU, 0x00500000U, 0x80500000U}) {
    expectErrorAfter(whole, block_length, bytesOf(length), {"compressed by lz4"});
  }
}

TEST_F(BagReaderTest, NamesTheChunkOfADamagedIndexAfterDecompression) {
  const std::string whole = write(rosbag::compression::LZ4, 1);
  const size_t entry = valueOf(whole, "ver") + 8;
  expectErrorAfter(whole, entry + 8, bytesOf(numberAt<uint32_t>(whole, entry + 8) + 3),
                   {"chunk with data at byte", "corrupt or truncated at byte"});
}

TEST_F(BagReaderTest, NamesMessagesThatAreNone) {
  const std::string whole = write();
  put(whole, valueOf(whole, "time") + 12, bytesOf(~uint32_t{0}));  // the text's length
  expectError({"/even", "corrupt message", "std_msgs/String"});
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  bag.write("/odd", ros::Time(1), sensor_msgs::Image());
  bag.close();
  expectError({"/odd", "message definition of std_msgs/String"});
}

template <class Message>
void expectNoRoomForImages(const std::string& path) {
  Message message;
  message.data.assign(100, 7);
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  bag.write("/image", ros::Time(1), message);
  bag.close();
  const auto read = [&] {
    BagReader reader(path);
    return reader.read(reader.entries({"/image"}).at(0)).template instantiate<Message>()->data;
  };
  EXPECT_EQ(read(), message.data);
  std::string bytes = readTextFile(path);
  const size_t pixels = bytes.find(std::string(100, 7));
  for (const uint32_t length : {101U, 0xffffffffU}) {
    bytes.replace(pixels - 4, 4, bytesOf(length));
    std::ofstream(path, std::ios::binary) << bytes;
    expectInputError(read, {path, "/image", "corrupt message"});
  }
}

TEST_F(BagReaderTest, MakesNoRoomForPixelsThatAreNotThere) {
  expectNoRoomForImages<sensor_msgs::Image>(path_);
  expectNoRoomForImages<sensor_msgs::CompressedImage>(path_);
}

// Run with sanitizers: no changed byte makes the reader access memory outside a buffer.
TEST_F(BagReaderTest, EndsInAnErrorOrInMessagesWhateverByteIsDamaged) {
  for (const auto compression : {rosbag::compression::Uncompressed, rosbag::compression::LZ4}) {
    const std::string whole = write(compression, 2, 1000000);
    int num_errors = 0;
    for (size_t at = 0; at < whole.size(); ++at) {
      if (at > 200 && at < 4000) {
        continue;  // the padding behind the file's header
      }
      for (const int value : {0x00, 0x01, 0x7f, 0xff}) {
        put(whole, at, std::string(1, static_cast<char>(value)));
        try {
          read();
        } catch (const InputError& error) {
          ++num_errors;
          EXPECT_THAT(error.what(), ::testing::HasSubstr(path_));
        }
      }
    }
    EXPECT_GT(num_errors, 1000);
  }
}

}  // namespace
}  // namespace vcharge
