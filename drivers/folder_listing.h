// The pictures of a folder in the order in which people count them.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace zeropose {

// img2 comes before img10: runs of digits are compared as numbers, everything else byte by byte.
bool natural_less(std::string_view a, std::string_view b);

// The files of the folder itself that end in png, tif, tiff, bmp or pgm, whatever their case, without hidden
// ones. Empty where there is no such folder or it cannot be read.
std::vector<std::filesystem::path> pictures_in(const std::filesystem::path& folder);

}  // namespace zeropose
