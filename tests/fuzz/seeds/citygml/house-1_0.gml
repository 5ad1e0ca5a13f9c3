<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:bldg="http://www.opengis.net/citygml/building/2.0" xmlns:dem="http://www.opengis.net/citygml/relief/2.0" xmlns:gen="http://www.opengis.net/citygml/generics/2.0" xmlns:gml="http://www.opengis.net/gml" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.opengis.net/citygml/building/2.0 http://schemas.opengis.net/citygml/building/2.0/building.xsd http://www.opengis.net/citygml/relief/2.0 http://schemas.opengis.net/citygml/relief/2.0/relief.xsd http://www.opengis.net/citygml/generics/2.0 http://schemas.opengis.net/citygml/generics/2.0/generics.xsd">
 <gml:name>mesh, tile 1_0</gml:name>
 <gml:boundedBy>
  <gml:Envelope srsName="urn:ogc:def:crs:EPSG::7415" srsDimension="3">
   <gml:lowerCorner>85010.7275 445999.5 100.1525</gml:lowerCorner>
   <gml:upperCorner>85042 446027.3838 110.8478</gml:upperCorner>
  </gml:Envelope>
 </gml:boundedBy>
 <cityObjectMember>
  <dem:ReliefFeature gml:id="terrain-1-0-relief">
   <dem:lod>1</dem:lod>
   <dem:reliefComponent>
    <dem:TINRelief gml:id="terrain-1-0">
     <dem:lod>1</dem:lod>
     <dem:tin>
      <gml:TriangulatedSurface>
       <gml:trianglePatches>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85020 445999.5 100.2501 85042 445999.5 100.1525 85032 446011.5 100.4193 85020 445999.5 100.2501</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85020 445999.5 100.2501 85032 446011.5 100.4193 85020 446021.5 101.372 85020 445999.5 100.2501</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85042 445999.5 100.1525 85042 446021.5 101.0514 85032 446011.5 100.4193 85042 445999.5 100.1525</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85032 446011.5 100.4193 85042 446021.5 101.0514 85020 446021.5 101.372 85032 446011.5 100.4193</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
       </gml:trianglePatches>
      </gml:TriangulatedSurface>
     </dem:tin>
    </dem:TINRelief>
   </dem:reliefComponent>
  </dem:ReliefFeature>
 </cityObjectMember>
 <cityObjectMember>
  <bldg:Building gml:id="b-85014-446018">
   <gen:stringAttribute name="block">
    <gen:value>1_0</gen:value>
   </gen:stringAttribute>
   <gen:doubleAttribute name="building_probability">
    <gen:value>0.85</gen:value>
   </gen:doubleAttribute>
   <gen:doubleAttribute name="completeness">
    <gen:value>0.998</gen:value>
   </gen:doubleAttribute>
   <gen:doubleAttribute name="cut_share">
    <gen:value>0</gen:value>
   </gen:doubleAttribute>
   <gen:measureAttribute name="eave_height_m">
    <gen:value uom="m">107.53</gen:value>
   </gen:measureAttribute>
   <gen:measureAttribute name="footprint_area_m2">
    <gen:value uom="m2">164.9</gen:value>
   </gen:measureAttribute>
   <gen:measureAttribute name="ground_height_m">
    <gen:value uom="m">101</gen:value>
   </gen:measureAttribute>
   <gen:stringAttribute name="method">
    <gen:value>gable</gen:value>
   </gen:stringAttribute>
   <gen:measureAttribute name="ridge_height_m">
    <gen:value uom="m">110.85</gen:value>
   </gen:measureAttribute>
   <gen:measureAttribute name="rmse_m">
    <gen:value uom="m">0.139</gen:value>
   </gen:measureAttribute>
   <gen:measureAttribute name="volume_m3">
    <gen:value uom="m3">1285.71</gen:value>
   </gen:measureAttribute>
   <gen:doubleAttribute name="wall_share">
    <gen:value>0.97</gen:value>
   </gen:doubleAttribute>
   <bldg:roofType codeSpace="http://www.sig3d.org/codelists/standard/building/2.0/_AbstractBuilding_roofType.xml">1030</bldg:roofType>
   <bldg:measuredHeight uom="m">9.85</bldg:measuredHeight>
   <bldg:lod0FootPrint>
    <gml:MultiSurface>
     <gml:surfaceMember>
      <gml:Polygon>
       <gml:exterior>
        <gml:LinearRing>
         <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85029.3105 446017.7227 100.9968 85013.9902 446012.5488 100.9968 85010.7275 446022.21 100.9968 85026.0488 446027.3838 100.9968</gml:posList>
        </gml:LinearRing>
       </gml:exterior>
      </gml:Polygon>
     </gml:surfaceMember>
    </gml:MultiSurface>
   </bldg:lod0FootPrint>
   <bldg:lod0RoofEdge>
    <gml:MultiSurface>
     <gml:surfaceMember>
      <gml:Polygon>
       <gml:exterior>
        <gml:LinearRing>
         <gml:posList srsDimension="3">85010.7275 446022.21 107.5343 85013.9902 446012.5488 107.5343 85029.3105 446017.7227 107.5343 85026.0488 446027.3838 107.5343 85010.7275 446022.21 107.5343</gml:posList>
        </gml:LinearRing>
       </gml:exterior>
      </gml:Polygon>
     </gml:surfaceMember>
    </gml:MultiSurface>
   </bldg:lod0RoofEdge>
   <bldg:lod1Solid>
    <gml:Solid>
     <gml:exterior>
      <gml:CompositeSurface>
       <gml:surfaceMember>
        <gml:Polygon>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 108.7939 85013.9902 446012.5488 108.7939 85029.3105 446017.7227 108.7939 85026.0488 446027.3838 108.7939 85010.7275 446022.21 108.7939</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85010.7275 446022.21 100.9968 85010.7275 446022.21 108.7939 85026.0488 446027.3838 108.7939 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 100.9968 85013.9902 446012.5488 100.9968 85013.9902 446012.5488 108.7939 85010.7275 446022.21 108.7939 85010.7275 446022.21 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85013.9902 446012.5488 100.9968 85029.3105 446017.7227 100.9968 85029.3105 446017.7227 108.7939 85013.9902 446012.5488 108.7939 85013.9902 446012.5488 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85029.3105 446017.7227 100.9968 85026.0488 446027.3838 100.9968 85026.0488 446027.3838 108.7939 85029.3105 446017.7227 108.7939 85029.3105 446017.7227 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85029.3105 446017.7227 100.9968 85013.9902 446012.5488 100.9968 85010.7275 446022.21 100.9968 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:CompositeSurface>
     </gml:exterior>
    </gml:Solid>
   </bldg:lod1Solid>
   <bldg:lod2Solid>
    <gml:Solid>
     <gml:exterior>
      <gml:CompositeSurface>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_0_poly"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_1_poly"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_2_poly"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_3_poly"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_4_poly"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_5_poly"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_6_poly"/>
      </gml:CompositeSurface>
     </gml:exterior>
    </gml:Solid>
   </bldg:lod2Solid>
   <bldg:boundedBy>
    <bldg:RoofSurface gml:id="b-85014-446018_lod2_0">
     <gen:measureAttribute name="azimuth_deg">
      <gen:value uom="deg">341.34</gen:value>
     </gen:measureAttribute>
     <gen:measureAttribute name="slope_deg">
      <gen:value uom="deg">38.86</gen:value>
     </gen:measureAttribute>
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_0_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 106.7399 85012.3584 446017.3799 110.8478 85027.6797 446022.5537 110.8478 85026.0488 446027.3838 106.7399 85010.7275 446022.21 106.7399</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:RoofSurface>
   </bldg:boundedBy>
   <bldg:boundedBy>
    <bldg:RoofSurface gml:id="b-85014-446018_lod2_1">
     <gen:measureAttribute name="azimuth_deg">
      <gen:value uom="deg">161.34</gen:value>
     </gen:measureAttribute>
     <gen:measureAttribute name="slope_deg">
      <gen:value uom="deg">38.86</gen:value>
     </gen:measureAttribute>
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_1_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85012.3584 446017.3799 110.8478 85013.9902 446012.5488 106.7399 85029.3105 446017.7227 106.7402 85027.6797 446022.5537 110.8478 85012.3584 446017.3799 110.8478</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:RoofSurface>
   </bldg:boundedBy>
   <bldg:boundedBy>
    <bldg:WallSurface gml:id="b-85014-446018_lod2_2">
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_2_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85010.7275 446022.21 100.9968 85010.7275 446022.21 106.7399 85026.0488 446027.3838 106.7399 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:WallSurface>
   </bldg:boundedBy>
   <bldg:boundedBy>
    <bldg:WallSurface gml:id="b-85014-446018_lod2_3">
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_3_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 100.9968 85013.9902 446012.5488 100.9968 85013.9902 446012.5488 106.7399 85012.3584 446017.3799 110.8478 85010.7275 446022.21 106.7399 85010.7275 446022.21 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:WallSurface>
   </bldg:boundedBy>
   <bldg:boundedBy>
    <bldg:WallSurface gml:id="b-85014-446018_lod2_4">
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_4_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85013.9902 446012.5488 100.9968 85029.3105 446017.7227 100.9968 85029.3105 446017.7227 106.7402 85013.9902 446012.5488 106.7399 85013.9902 446012.5488 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:WallSurface>
   </bldg:boundedBy>
   <bldg:boundedBy>
    <bldg:WallSurface gml:id="b-85014-446018_lod2_5">
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_5_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85029.3105 446017.7227 100.9968 85026.0488 446027.3838 100.9968 85026.0488 446027.3838 106.7399 85027.6797 446022.5537 110.8478 85029.3105 446017.7227 106.7402 85029.3105 446017.7227 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:WallSurface>
   </bldg:boundedBy>
   <bldg:boundedBy>
    <bldg:GroundSurface gml:id="b-85014-446018_lod2_6">
     <bldg:lod2MultiSurface>
      <gml:MultiSurface>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_6_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85029.3105 446017.7227 100.9968 85013.9902 446012.5488 100.9968 85010.7275 446022.21 100.9968 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </bldg:lod2MultiSurface>
    </bldg:GroundSurface>
   </bldg:boundedBy>
  </bldg:Building>
 </cityObjectMember>
</CityModel>
