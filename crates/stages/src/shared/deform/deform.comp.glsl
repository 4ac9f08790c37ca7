// Writes the drawn vertices of skinned and morphed meshes in a pose (glTF 2.0, sections 3.7.2.2 and 3.7.3.3): a thread a vertex.
//
// 1. Position, normal and tangent of the shape plus the targets' differences times their weights.
// 2. The weighted sum of the joints' matrices moves the position; its cofactors, which are the inverse transpose times the determinant,
//    turn the normal, the matrix itself the tangent, and where it mirrors the bitangent changes its sign.
//
// CPU twin: crates/oracle/src/deform.rs.
// In: DeformGroups, Deformations, Shapes, Influences, Targets, Differences; Joints, Weights of the pose. Out: Positions, Attributes, those
// vertices alone. Dispatch: a group each of DeformGroups, in rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_rows.glsl"
#include "packing.glsl"

const uint GROUP_VERTICES = 96u;        // whole triangles
layout(local_size_x = 96) in;

// Twins: structs DeformGroup and Deformed in crates/shader/src/structs.rs, checked at build.
struct DeformGroup {
    uint deformation;
    uint first;
};

struct Deformed {
    uint first_vertex;
    uint vertex_count;
    uint first_shape;
    uint is_flat;
    uint set_count;
    uint first_influence;
    uint first_joint;
    uint target_count;
    uint first_target;
    uint first_weight;
};

struct ShapeVertex {
    vec3 position;
    uint normal;
    uint tangent;
};

struct JointInfluences {
    uvec2 joints;       // four of 16 bits
    float weights[4];
};

struct Joint {
    vec4 row0, row1, row2;      // object space from the shape's
};

layout(set = 0, binding = 0, scalar) readonly buffer DeformGroups { DeformGroup groups[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Deformations { Deformed deformations[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Shapes { ShapeVertex shapes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Influences { JointInfluences influences[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Targets { uint targets[]; };         // first differences of position, normal, tangent
layout(set = 0, binding = 5, scalar) readonly buffer Differences { vec3 differences[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Joints { Joint joints[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Weights { float weights[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Positions { float positions_os[]; };     // three a vertex
layout(set = 0, binding = 7, scalar) writeonly buffer Attributes { uint attributes[]; };       // seven a vertex, the first two normal and tangent
layout(push_constant, scalar) uniform Push {
    uint group_count;
};

const uint NO_DIFFERENCES = 0xffffffffu;
const uint NO_TANGENT = 0x8000u;
// Sine of the angle to its normal below which a tangent gives no frame, as crates/scene/src/tangent.rs has it.
const float PARALLEL_SINE = 2e-3;

shared vec3 corners_os[GROUP_VERTICES];

struct Vertex {
    vec3 position, normal, tangent;
    float handedness;
};

vec3 difference(uint first, uint vertex) {
    return first == NO_DIFFERENCES ? vec3(0.0) : differences[first + vertex];
}

Vertex morphed(Deformed d, uint vertex) {
    ShapeVertex s = shapes[d.first_shape + vertex];
    vec4 tangent = unpack_tangent(s.tangent);
    Vertex v = Vertex(s.position, unpack_normal(s.normal), tangent.xyz, tangent.w);
    for (uint k = 0u; k < d.target_count; ++k) {
        float weight = weights[d.first_weight + k];
        if (weight != 0.0) {
            uint target = 3u * (d.first_target + k);
            v.position += weight * difference(targets[target], vertex);
            v.normal += weight * difference(targets[target + 1u], vertex);
            v.tangent += weight * difference(targets[target + 2u], vertex);
        }
    }
    return v;
}

Vertex skinned(Deformed d, uint vertex, Vertex v) {
    if (d.set_count == 0u) {
        return v;
    }
    Joint sum = Joint(vec4(0.0), vec4(0.0), vec4(0.0));
    for (uint k = 0u; k < d.set_count; ++k) {
        JointInfluences of = influences[d.first_influence + vertex * d.set_count + k];
        for (uint i = 0u; i < 4u; ++i) {
            float weight = of.weights[i];
            if (weight > 0.0) {
                uint pair = of.joints[i / 2u];
                Joint joint = joints[d.first_joint + (i % 2u == 0u ? pair & 0xffffu : pair >> 16)];
                sum.row0 += weight * joint.row0;
                sum.row1 += weight * joint.row1;
                sum.row2 += weight * joint.row2;
            }
        }
    }
    vec3 row0 = sum.row0.xyz, row1 = sum.row1.xyz, row2 = sum.row2.xyz;
    vec4 p = vec4(v.position, 1.0);
    v.position = vec3(dot(sum.row0, p), dot(sum.row1, p), dot(sum.row2, p));
    float sign = dot(row0, cross(row1, row2)) < 0.0 ? -1.0 : 1.0;
    v.normal = sign * vec3(dot(cross(row1, row2), v.normal), dot(cross(row2, row0), v.normal), dot(cross(row0, row1), v.normal));
    v.tangent = vec3(dot(row0, v.tangent), dot(row1, v.tangent), dot(row2, v.tangent));
    v.handedness *= sign;
    return v;
}

// A vector made unit, however short; zero where it has no direction.
vec3 direction(vec3 v) {
    float longest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    return longest > 0.0 && longest < 1e37 ? normalize(v / longest) : vec3(0.0);
}

void main() {
    uint number = group_number();
    if (number >= group_count) {
        return;
    }
    DeformGroup group = groups[number];
    Deformed d = deformations[group.deformation];
    uint thread = gl_LocalInvocationIndex, vertex = group.first + thread;
    bool is_there = vertex < d.vertex_count;
    Vertex v = Vertex(vec3(0.0), vec3(0.0), vec3(0.0), 1.0);
    if (is_there) {
        v = skinned(d, vertex, morphed(d, vertex));
    }
    if (d.is_flat != 0u) {
        corners_os[thread] = v.position;
        barrier();
        uint first = thread - thread % 3u;
        vec3 a = corners_os[first];
        // Edges made comparable first: products of small ones would underflow.
        v.normal = cross(direction(corners_os[first + 1u] - a), direction(corners_os[first + 2u] - a));
    }
    if (!is_there) {
        return;
    }
    // What has no direction looks along z, as vertices of files do.
    vec3 normal = direction(v.normal), tangent = direction(v.tangent);
    normal = normal == vec3(0.0) ? vec3(0.0, 0.0, 1.0) : normal;
    uint out_vertex = d.first_vertex + vertex;
    positions_os[3u * out_vertex] = v.position.x;
    positions_os[3u * out_vertex + 1u] = v.position.y;
    positions_os[3u * out_vertex + 2u] = v.position.z;
    attributes[7u * out_vertex] = packSnorm2x16(octahedral_encode(normal));
    bool has_tangent = length(cross(normal, tangent)) > PARALLEL_SINE;
    attributes[7u * out_vertex + 1u] = has_tangent ? pack_tangent(vec4(tangent, v.handedness))
                                                   : NO_TANGENT | (v.handedness < 0.0 ? 0x10000u : 0u);
}
