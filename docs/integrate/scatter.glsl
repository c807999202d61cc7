layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba16f, set = 0, binding = 0) uniform image2D result;
layout(push_constant, std430) uniform Pass { float mm_per_pixel, a, b, c; };

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(result)))) return;
    vec2 position = vec2(at) + 0.5, texel = 1.0 / vec2(textureSize(t0, 0));
    vec4 made;
    #CODE
    imageStore(result, at, made);
}
