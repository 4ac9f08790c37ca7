// The head of a pixel's list of lights.
#ifndef AFTERLIGHT_LIGHT_HEAD
#define AFTERLIGHT_LIGHT_HEAD

struct LightHead {
    uint link;          // a node's number plus one; 0: the list is empty
    float nearest_m;    // view distances between which the list holds: those of the pixel's surfaces, with room for rounding;
    float farthest_m;   // without a surface the second is less than the first
};

#endif
