// A description of a camera with features that the library's fake camera lacks, for its memory above 0x2000,
// which nothing else uses.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace zeropose {

// Where its features lie.
namespace rich {
inline constexpr std::uint32_t width = 0x100, height = 0x104, pixel_format = 0x128, offset_x = 0x130,
                               offset_y = 0x134, exposure_us = 0x120, gain = 0x110, frame_period_us = 0x138,
                               trigger_mode = 0x300, trigger_source = 0x304, trigger_software = 0x30c,
                               black_level = 0x2000, gamma_enable = 0x2004, gamma = 0x2008,
                               ptp_enable = 0x200c, ptp_status = 0x2010, temperature = 0x2014,
                               exposure_auto = 0x2018, chunk_mode = 0x201c, chunk_selector = 0x2020,
                               chunk_enable = 0x2024, gain_auto = 0x2028, trigger_selector = 0x202c,
                               width_of_sensor = 0x11c, height_of_sensor = 0x118;
inline constexpr std::uint32_t trigger_source_software = 1, trigger_source_line1 = 0;
}  // namespace rich

class RichDescription {
 public:
  RichDescription() {
    std::string name = (std::filesystem::temp_directory_path() / "rich-camera-XXXXXX").string();
    const int fd = ::mkstemp(name.data());
    if (fd >= 0) ::close(fd);
    path_ = name;
    std::ofstream(path_) << text();
  }
  ~RichDescription() { std::filesystem::remove(path_); }
  RichDescription(const RichDescription&) = delete;
  RichDescription& operator=(const RichDescription&) = delete;
  std::string path() const { return path_.string(); }

 private:
  using Words = std::vector<std::pair<std::string, std::uint32_t>>;

  void reg(const std::string& tag, const std::string& name, std::uint32_t address, const std::string& more) {
    features_ << "<" << tag << " Name=\"" << name << "\"><Address>0x" << std::hex << address << std::dec
              << "</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>" << more
              << "<Endianess>BigEndian</Endianess></" << tag << ">\n";
  }
  void feature(const std::string& tag, const std::string& name, const std::string& inside) {
    names_ << "<pFeature>" << name << "</pFeature>";
    features_ << "<" << tag << " Name=\"" << name << "\">" << inside << "</" << tag << ">\n";
  }
  void over_register(const std::string& tag, const std::string& name, std::uint32_t address,
                     const std::string& inside = {}) {
    feature(tag, name, inside + "<pValue>" + name + "Reg</pValue>");
    reg("IntReg", name + "Reg", address, "<Sign>Unsigned</Sign>");
  }
  void real(const std::string& name, std::uint32_t address) {
    names_ << "<pFeature>" << name << "</pFeature>";
    reg("FloatReg", name, address, "");
  }
  void flag(const std::string& name, std::uint32_t address) {
    feature("Boolean", name, "<pValue>" + name + "Reg</pValue><OnValue>1</OnValue><OffValue>0</OffValue>");
    reg("IntReg", name + "Reg", address, "<Sign>Unsigned</Sign>");
  }
  void choice(const std::string& name, std::uint32_t address, const Words& words) {
    std::string entries;
    for (const auto& [word, value] : words)
      entries += "<EnumEntry Name=\"" + word + "\"><Value>" + std::to_string(value) + "</Value></EnumEntry>";
    over_register("Enumeration", name, address, entries);
  }
  void command(const std::string& name, std::uint32_t address, int value) {
    feature("Command", name,
            "<pValue>" + name + "Reg</pValue><CommandValue>" + std::to_string(value) + "</CommandValue>");
    reg("IntReg", name + "Reg", address, "<Sign>Unsigned</Sign>");
  }

  void picture() {
    over_register("Integer", "SensorWidth", rich::width_of_sensor);
    over_register("Integer", "SensorHeight", rich::height_of_sensor);
    over_register("Integer", "Width", rich::width);
    over_register("Integer", "Height", rich::height);
    over_register("Integer", "OffsetX", rich::offset_x);
    over_register("Integer", "OffsetY", rich::offset_y);
    choice("PixelFormat", rich::pixel_format,
           {{"Mono8", 0x01080001},
            {"Mono10", 0x01100003},
            {"Mono12", 0x01100005},
            {"Mono16", 0x01100007},
            {"Mono10Packed", 0x010c0004},
            {"Mono12Packed", 0x010c0006}});
    feature("IntSwissKnife", "PayloadSize",
            "<pVariable Name=\"W\">Width</pVariable><pVariable Name=\"H\">Height</pVariable>"
            "<pVariable Name=\"F\">PixelFormatReg</pVariable>"
            "<Formula>W * H * ((F &gt;&gt; 16) &amp; 0xff) / 8</Formula>");
  }
  void acquisition() {
    choice("AcquisitionMode", 0x12c, {{"Continuous", 1}, {"SingleFrame", 2}});
    command("AcquisitionStart", 0x124, 1);
    command("AcquisitionStop", 0x124, 0);
    feature("Float", "AcquisitionFrameRate", "<pValue>FrameRateOfPeriod</pValue>");
    features_ << "<Converter Name=\"FrameRateOfPeriod\"><FormulaTo>1000000 / FROM</FormulaTo>"
                 "<FormulaFrom>1000000 / TO</FormulaFrom><pValue>FramePeriod</pValue></Converter>\n";
    over_register("Integer", "FramePeriod", rich::frame_period_us, "<Min>1000</Min><Max>1000000</Max>");
    choice("TriggerSelector", rich::trigger_selector, {{"FrameStart", 1}});
    choice("TriggerMode", rich::trigger_mode, {{"Off", 0}, {"On", 1}});
    choice("TriggerSource", rich::trigger_source,
           {{"Line1", rich::trigger_source_line1}, {"Software", rich::trigger_source_software}});
    choice("TriggerActivation", 0x308, {{"RisingEdge", 1}});
    command("TriggerSoftware", rich::trigger_software, 1);
  }
  void light() {
    over_register("Float", "ExposureTime", rich::exposure_us);
    choice("ExposureAuto", rich::exposure_auto, {{"Off", 0}, {"Continuous", 2}});
    over_register("Float", "Gain", rich::gain);
    choice("GainAuto", rich::gain_auto, {{"Off", 0}, {"Continuous", 2}});
    real("BlackLevel", rich::black_level);
    flag("GammaEnable", rich::gamma_enable);
    real("Gamma", rich::gamma);
  }
  void extras() {
    flag("PtpEnable", rich::ptp_enable);
    choice("PtpStatus", rich::ptp_status, {{"Disabled", 0}, {"Master", 1}, {"Slave", 2}});
    real("DeviceTemperature", rich::temperature);
    flag("ChunkModeActive", rich::chunk_mode);
    choice("ChunkSelector", rich::chunk_selector, {{"Timestamp", 1}, {"ExposureTime", 2}});
    flag("ChunkEnable", rich::chunk_enable);
  }

  std::string text() {
    picture();
    acquisition();
    light();
    extras();
    return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<RegisterDescription ModelName=\"Rich\" "
           "VendorName=\"zeropose\" StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" "
           "SchemaMinorVersion=\"0\" SchemaSubMinorVersion=\"1\" MajorVersion=\"1\" MinorVersion=\"0\" "
           "SubMinorVersion=\"0\" ToolTip=\"\" ProductGuid=\"0\" VersionGuid=\"0\" "
           "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n<Category Name=\"Root\">" +
           names_.str() + "</Category>\n" + features_.str() +
           "<Port Name=\"Device\"></Port>\n</RegisterDescription>\n";
  }

  std::filesystem::path path_;
  std::ostringstream names_, features_;
};

}  // namespace zeropose
