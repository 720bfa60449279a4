#pragma once

/// The sRGB transfer function (IEC 61966-2-1), which integer image formats are stored with.
namespace mirrorbake {

/// Scene-linear value to sRGB, both nominally in [0,1]. Clips to [0,1] first; NaN gives 0.
float srgb_encode(float linear);

/// sRGB to scene-linear, both nominally in [0,1]. Below 0 the linear segment goes on; above 1 the power does.
float srgb_decode(float encoded);

}  // namespace mirrorbake
